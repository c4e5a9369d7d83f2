//! Numbers of servos, each with its source.

/// How a servo takes a pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Each pulse drives the motor until the shaft is at its angle, for a servo frame at the longest; nothing drives it without pulses.
    Analogue,
    /// A processor keeps the angle of the last pulse that it accepted.
    Digital,
}

/// What a data sheet says of a servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DataSheet {
    /// Name.
    pub name: &'static str,
    /// How it takes a pulse.
    pub kind: Kind,
    /// Time for 60 degrees without load, at the highest supply of the data sheet, s.
    pub s_per_60_degrees: f64,
    /// A difference in the pulse that does not move it, us.
    pub dead_band_us: f64,
    /// Shortest and longest pulse that it takes; another one is ignored, us.
    pub accepted_us: [f64; 2],
    /// Shortest and longest pulse within its mechanical range: it stops there, us.
    pub mechanical_us: [f64; 2],
    /// Time after the supply came on in which it takes no pulse, s.
    pub start_up_s: f64,
}

impl DataSheet {
    /// Hitec HS-311, an analogue servo. "Announced specification of HS-311 standard servo", Hitec RCD Korea: 0.15 s for 60 degrees at 6 V (0.19 s at
    /// 4.8 V), dead band 5 us. It turns 180 degrees at 600 to 2400 us (DFRobot, product SER0001).
    ///
    /// The data sheet names no shortest pulse. An analogue circuit compares the pulse with one of its own, so that any pulse that it sees at all
    /// drives it: typical circuits see some microseconds; 10 us stand for that.
    pub const HS_311: DataSheet = DataSheet {
        name: "Hitec HS-311",
        kind: Kind::Analogue,
        s_per_60_degrees: 0.15,
        dead_band_us: 5.0,
        accepted_us: [10.0, 3_000.0],
        mechanical_us: [600.0, 2_400.0],
        start_up_s: 0.0,
    };

    /// FEETECH FT-7235-C018, a digital servo. Product page 530069 of FEETECH: 0.098 s for 60 degrees at 8.4 V, dead band 4 us at most, pulses of 500 to
    /// 2500 us, which are 180 degrees, "digital comparator".
    ///
    /// No source has the time that its processor takes to start. 0.2 s are an assumption, not a measurement.
    pub const FT_7235: DataSheet = DataSheet {
        name: "FEETECH FT-7235-C018",
        kind: Kind::Digital,
        s_per_60_degrees: 0.098,
        dead_band_us: 4.0,
        accepted_us: [500.0, 2_500.0],
        mechanical_us: [500.0, 2_500.0],
        start_up_s: 0.2,
    };

    /// The servo of a kind.
    #[must_use]
    pub const fn of(kind: Kind) -> &'static Self {
        match kind {
            Kind::Analogue => &Self::HS_311,
            Kind::Digital => &Self::FT_7235,
        }
    }
}
