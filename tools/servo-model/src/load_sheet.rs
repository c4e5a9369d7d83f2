//! Three classes of hobby servo under load, each with its source.

use crate::Kind;

/// What a data sheet says at one supply.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupplyPoint {
    /// Supply, V.
    pub volts: f64,
    /// Torque at speed 0, N m.
    pub stall_nm: f64,
    /// Time for 60 degrees without load, s.
    pub s_per_60_degrees: f64,
}

impl SupplyPoint {
    /// A point in the units of data sheets: V, kgf cm, s for 60 degrees.
    const fn new(volts: f64, stall_kgf_cm: f64, s_per_60_degrees: f64) -> Self {
        SupplyPoint { volts, stall_nm: stall_kgf_cm * 0.098_066_5, s_per_60_degrees }
    }
}

/// What is known of a servo under load.
///
/// No data sheet has the proportional band, the inertia of the rotor at the shaft and the friction of the gear. These stand for them, for want of a
/// measurement: a band of 5 degrees, an inertia that the motor brings to its no-load speed in about 30 ms, and friction of 5 % of the stall torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadSheet {
    /// Name.
    pub name: &'static str,
    /// How it takes a pulse.
    pub kind: Kind,
    /// Lowest and highest supply that the source names, the lowest first.
    pub points: [SupplyPoint; 2],
    /// Error from the edge of the dead band on at which the motor gets the whole supply, rad.
    pub band_rad: f64,
    /// A difference in the pulse that does not move it, us.
    pub dead_band_us: f64,
    /// Shortest and longest pulse that it takes; another one is ignored, us.
    pub accepted_us: [f64; 2],
    /// Shortest and longest pulse within its mechanical range, us.
    pub mechanical_us: [f64; 2],
    /// Inertia of rotor and gear at the shaft, kg m^2.
    pub rotor_kg_m2: f64,
    /// Friction of the gear at the shaft, N m.
    pub friction_nm: f64,
}

/// 5 degrees.
const BAND_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;

impl LoadSheet {
    /// A micro servo of 9 g, TowerPro SG90, analogue. Torque and speed at two supplies: product page "servo motor SG90" of musefsales.com (1.8 kgf
    /// cm, 0.12 s at 4.8 V; 2.2 kgf cm, 0.10 s at 6 V). TowerPro's data sheet has 4.8 V only: 1.8 kgf cm, 0.1 s, dead band 10 us. No source names the
    /// accepted pulses; 500 to 2400 us is the travel that a vendor's page has (Smarthon, servo SG90).
    pub const SG90: LoadSheet = LoadSheet {
        name: "SG90",
        kind: Kind::Analogue,
        points: [SupplyPoint::new(4.8, 1.8, 0.12), SupplyPoint::new(6.0, 2.2, 0.10)],
        band_rad: BAND_RAD,
        dead_band_us: 10.0,
        accepted_us: [10.0, 3_000.0],
        mechanical_us: [500.0, 2_400.0],
        rotor_kg_m2: 0.000_6,
        friction_nm: 0.01,
    };

    /// A standard servo, TowerPro MG996R: 9.4 kgf cm, 0.17 s at 4.8 V; 11 kgf cm, 0.14 s at 6 V; dead band 5 us (TowerPro's data sheet, as
    /// electronicoscaldas.com has it). Sellers call it analogue or digital; analogue stands for it, since that one loses its torque without pulses.
    /// The data sheet says that it turns about 120 degrees, sellers say 180; 500 to 2500 us of a scale of 90 degrees for 1000 us stand for it.
    pub const MG996R: LoadSheet = LoadSheet {
        name: "MG996R",
        kind: Kind::Analogue,
        points: [SupplyPoint::new(4.8, 9.4, 0.17), SupplyPoint::new(6.0, 11.0, 0.14)],
        band_rad: BAND_RAD,
        dead_band_us: 5.0,
        accepted_us: [10.0, 3_000.0],
        mechanical_us: [500.0, 2_500.0],
        rotor_kg_m2: 0.004,
        friction_nm: 0.05,
    };

    /// A digital servo of 25 kgf cm, DSSERVO DS3225MG: 21 kgf cm, 0.15 s at 5 V; 25 kgf cm, 0.13 s at 6.8 V; dead band 3 us; pulses of 500 to 2500 us
    /// (the vendor's text in the repository vniclos/-6-Axis-Robot-Arm---ESP-32, file Esp32_Robot_Core_270/src/_readme.txt).
    pub const DS3225: LoadSheet = LoadSheet {
        name: "DS3225",
        kind: Kind::Digital,
        points: [SupplyPoint::new(5.0, 21.0, 0.15), SupplyPoint::new(6.8, 25.0, 0.13)],
        band_rad: BAND_RAD,
        dead_band_us: 3.0,
        accepted_us: [500.0, 2_500.0],
        mechanical_us: [500.0, 2_500.0],
        rotor_kg_m2: 0.008,
        friction_nm: 0.11,
    };

    /// All of them.
    pub const ALL: [&'static LoadSheet; 3] = [&Self::SG90, &Self::MG996R, &Self::DS3225];
}
