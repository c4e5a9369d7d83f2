//! The numbers of `gait::catalogue` and of the gait `natural-walk`: read-outs that were fitted to a recorded stride.
//!
//! The recording is `tests/traces/gaitkit_fukuchi_healthy.csv` of the repository ([`RECORDING_SHA256`]): a healthy adult who walks
//! overground (Fukuchi et al. 2018, CC BY 4.0). Its two whole strides, averaged, are described by [`NATURAL_WALK`] (least squares). Each
//! read-out is the linear least-squares fit of four joints to that stride, with a ridge of 1e-3 of each state's variance, over ten
//! strides on the limit cycle. `cargo footfall gait-error` computes the fits and their errors again and prints them beside the errors of
//! the generators as they are built here.

use joint_units::{Period, Phase, Radians};

use crate::BuildError;
use crate::gait::default_walk::STRIDE_SECONDS;
use crate::joints::linear::{LinearJoints, LinearJointsConfig, PhasePlane};
use crate::math::first_order::Flow;
use crate::waveform::shape::FourierShape;

/// SHA-256 of the recording that every number of this module was fitted to.
pub const RECORDING_SHA256: &str = "6982ff1d43bfb00fe66873ee02ed704bcb4fd61b7d51b69eed92e684b20ce7f4";

/// Mean, cosines and sines of harmonics 1 to 6 of a joint, in degrees.
pub type Harmonics = (f32, [f32; 6], [f32; 6]);

/// The shape of these coefficients.
///
/// # Errors
/// As [`FourierShape::new`].
pub(crate) fn shape(&(mean, cos, sin): &Harmonics) -> Result<FourierShape<6>, BuildError> {
    let radians = |degrees: f32| Radians::from_degrees(degrees).0;
    FourierShape::new(Radians::from_degrees(mean), cos.map(radians), sin.map(radians))
}

/// Left hip, right hip, left knee, right knee over the gait phase; phase 0 where the left hip is most flexed.
pub const NATURAL_WALK: [Harmonics; 4] = [
    (7.57, [14.73, 1.91, -0.09, 0.70, 0.55, 0.06], [12.00, -4.21, -2.05, 0.41, 0.22, 0.00]),
    (9.39, [-14.42, 2.20, 0.32, 0.60, -0.38, -0.03], [-11.54, -3.42, 1.94, 0.32, -0.38, 0.00]),
    (24.44, [17.00, -1.44, 0.30, 2.64, 1.77, 0.43], [-15.74, -17.79, -5.53, 0.51, 0.48, 0.20]),
    (26.73, [-16.94, -1.11, 0.37, 2.26, -1.44, 0.21], [16.43, -17.19, 5.50, 0.48, -0.82, 0.17]),
];

/// Mean of each joint over the recorded stride, degrees.
pub(crate) const MEANS: [f32; 4] = [7.57, 9.39, 24.44, 26.73];

/// The limit cycle of a model, and the read-out that was fitted to it, in degrees.
pub(crate) struct Fitted<const D: usize, const M: usize> {
    /// Units of the model's time that one cycle takes.
    cycle: f32,
    /// A state on the limit cycle, where the gait phase is 0.
    start: [f32; D],
    /// States that are read out.
    states: [usize; M],
    plane: PhasePlane,
    /// Gait phase where the phase of the plane is 0, in cycles.
    lead: f32,
    bound: f32,
    /// Degrees.
    offsets: [f32; 4],
    /// Degrees per unit of the state.
    weights: [[f32; M]; 4],
}

impl<const D: usize, const M: usize> Fitted<D, M> {
    pub(crate) fn build<F: Flow<f32, D>>(&self, flow: F, period: Period) -> Result<LinearJoints<F, D, M>, BuildError> {
        let radians = |degrees: f32| Radians::from_degrees(degrees).0;
        let config = LinearJointsConfig {
            start: self.start,
            cycle: self.cycle,
            stride_s: STRIDE_SECONDS,
            states: self.states,
            weights: self.weights.map(|row| row.map(radians)),
            offsets: self.offsets.map(Radians::from_degrees),
            plane: self.plane,
            lead: Phase::from_cycles(self.lead),
            bound: self.bound,
        };
        config.build(flow, period)
    }
}

pub(crate) const VAN_DER_POL: Fitted<4, 2> = Fitted {
    cycle: 7.045_957,
    start: [1.942_84, 0.813_35, -1.942_84, -0.813_35],
    states: [0, 1],
    plane: PhasePlane { x: 0, y: 1, centre: (0.0, 0.0), radius: (2.0602, -2.7134) },
    lead: 0.0490,
    bound: 8.0,
    offsets: MEANS,
    weights: [[8.984, 0.238], [-8.719, -0.293], [2.133, 11.45], [-1.869, -11.67]],
};

pub(crate) const HOPF: Fitted<4, 2> = Fitted {
    cycle: 1.003_181,
    start: [-1.045_63, -0.122_52, 1.045_63, 0.122_52],
    states: [0, 1],
    plane: PhasePlane { x: 0, y: 1, centre: (0.0, 0.0), radius: (1.0502, 1.0110) },
    lead: 0.4807,
    bound: 5.0,
    offsets: MEANS,
    weights: [[-12.914, -12.479], [12.661, 12.01], [-17.94, 14.596], [17.948, -15.284]],
};

pub(crate) const ADAPTIVE_HOPF: Fitted<3, 2> = Fitted {
    cycle: 1.0,
    start: [-0.882_29, -0.4707, core::f32::consts::TAU],
    states: [0, 1],
    plane: PhasePlane { x: 0, y: 1, centre: (0.0, 0.0), radius: (1.0, 1.0) },
    lead: 0.4220,
    bound: 20.0,
    offsets: MEANS,
    weights: [[-7.348, -17.521], [7.291, 16.969], [-22.408, 5.885], [22.68, -6.522]],
};

pub(crate) const MATSUOKA: Fitted<8, 8> = Fitted {
    cycle: 32.810_974,
    start: [-0.802_12, -0.419_93, -0.557_72, 0.623_54, 0.202_13, 0.051_51, 0.102_04, 0.180_86],
    states: [0, 1, 2, 3, 4, 5, 6, 7],
    plane: PhasePlane { x: 4, y: 6, centre: (0.1519, 0.1519), radius: (0.1139, -0.1139) },
    lead: 0.8757,
    bound: 5.0,
    offsets: [-6.797, -1.425, 19.685, 20.589],
    weights: [
        [-12.857, 7.554, 1.486, 1.213, 111.946, 3.825, -44.339, 35.399],
        [6.964, -12.422, 0.914, 2.156, -9.23, 101.503, 33.406, -45.642],
        [-16.767, 7.325, -8.491, 2.961, 216.934, 35.189, -12.983, -216.497],
        [7.184, -15.816, 2.342, -6.311, 27.653, 223.516, -210.22, -5.636],
    ],
};

pub(crate) const HALF_CENTRE: Fitted<8, 4> = Fitted {
    cycle: 29.581_814,
    start: [0.472_48, 0.472_48, -0.810_03, -0.810_03, 0.234_89, 0.234_89, 0.187_26, 0.187_26],
    states: [0, 3, 4, 7],
    plane: PhasePlane { x: 0, y: 4, centre: (-0.1845, 0.1864), radius: (0.7972, 0.0981) },
    lead: 0.9140,
    bound: 5.0,
    offsets: [85.515, 71.69, 374.583, 365.695],
    weights: [
        [-5.882, -25.775, -139.336, -251.16],
        [-24.184, -4.736, -209.545, -102.512],
        [-30.06, -61.199, -968.867, -786.171],
        [-60.39, -29.329, -754.146, -944.841],
    ],
};

pub(crate) const FITZHUGH_NAGUMO: Fitted<4, 4> = Fitted {
    cycle: 39.125_718,
    start: [-1.448_39, 1.366_51, -0.963_35, -0.300_88],
    states: [0, 1, 2, 3],
    plane: PhasePlane { x: 0, y: 1, centre: (-0.0348, 0.5865), radius: (1.9756, 0.8876) },
    lead: 0.6412,
    bound: 8.0,
    offsets: [-8.583, -4.376, -34.828, -30.405],
    weights: [
        [-6.059, 24.053, 3.306, 7.698],
        [3.027, 5.291, -6.052, 21.323],
        [2.333, 72.795, -1.731, 50.704],
        [-1.965, 48.45, 2.429, 70.528],
    ],
};

pub(crate) const MORRIS_LECAR: Fitted<4, 4> = Fitted {
    cycle: 83.747_11,
    start: [-3.063_09, 0.514_24, -32.413_17, 0.1128],
    states: [0, 1, 2, 3],
    plane: PhasePlane { x: 0, y: 1, centre: (-7.9252, 0.3139), radius: (43.0629, 0.2031) },
    lead: 0.7681,
    bound: 200.0,
    offsets: [-0.967, -0.832, 37.14, 37.365],
    weights: [
        [-0.113, 74.247, 0.29, -28.158],
        [0.255, -25.702, -0.133, 74.121],
        [0.749, 44.687, 0.299, -13.555],
        [0.263, -10.597, 0.735, 45.898],
    ],
};

pub(crate) const TERMAN_WANG: Fitted<4, 4> = Fitted {
    cycle: 89.813_01,
    start: [-0.639_72, 8.036_22, -1.466_36, 3.2734],
    states: [0, 1, 2, 3],
    plane: PhasePlane { x: 0, y: 1, centre: (-0.0271, 5.5558), radius: (2.1367, 2.5071) },
    lead: 0.7051,
    bound: 20.0,
    offsets: [-109.679, -87.077, -465.354, -445.071],
    weights: [
        [-3.618, 13.964, 1.67, 7.297],
        [1.495, 5.473, -3.628, 11.998],
        [3.139, 48.771, -2.534, 40.4],
        [-2.609, 38.784, 3.287, 47.116],
    ],
};

pub(crate) const GOLUBITSKY: Fitted<8, 2> = Fitted {
    cycle: 1.0,
    start: [-1.190_84, -0.6942, 1.190_84, 0.6942, 1.190_84, 0.6942, -1.190_84, -0.6942],
    states: [0, 1],
    plane: PhasePlane { x: 0, y: 1, centre: (0.0, 0.0), radius: (1.3784, 1.3784) },
    lead: 0.4160,
    bound: 5.0,
    offsets: MEANS,
    weights: [[-4.848, -12.903], [4.821, 12.501], [-16.406, 3.654], [16.62, -4.108]],
};

/// Point of each oscillator of the bank where the gait phase is 0.
pub(crate) const PROGRAMMABLE_START: [[f32; 2]; 4] =
    [[0.057_09, -0.998_37], [0.067_78, -1.028_33], [0.147_22, -1.027_68], [0.215_69, -1.019_57]];

/// Weights of (x, y) of each oscillator for each joint, degrees.
pub(crate) const PROGRAMMABLE_WEIGHTS: [[[f32; 2]; 4]; 4] = [
    [[12.861, -13.984], [-3.646, -2.147], [-1.907, -0.213], [0.542, -0.564]],
    [[-12.384, 13.702], [-2.873, -2.365], [1.849, -0.02], [0.436, -0.49]],
    [[-14.693, -17.913], [-16.704, 0.016], [-5.043, -1.085], [1.1, -2.343]],
    [[15.385, 17.894], [-16.1, -0.254], [5.141, 0.449], [0.981, -1.997]],
];
