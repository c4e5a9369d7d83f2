//! The list of oscillators: parameters, ranges, starts and time scales of each.

use std::f64::consts::TAU;

use cpg_core::Rk4;
use cpg_core::oscillator::fitzhugh_nagumo::FitzHughNagumo;
use cpg_core::oscillator::hopf::Hopf;
use cpg_core::oscillator::matsuoka::Matsuoka;
use cpg_core::oscillator::morris_lecar::MorrisLecar;
use cpg_core::oscillator::rayleigh::RayleighConfig;
use cpg_core::oscillator::terman_wang::TermanWang;
use cpg_core::oscillator::van_der_pol::VanDerPol;
use generator_file::model::network;
use joint_units::Period;

use super::flow::model;
use super::kind::{Kind, Parameter};

const fn parameter(name: &'static str, default: f64, least: f64, most: f64) -> Parameter {
    Parameter { name, default, least, most }
}

/// Every oscillator.
pub const KINDS: &[Kind] = &[
    Kind {
        name: "van-der-pol",
        what: "van der Pol oscillator",
        time_unit: "units of time",
        parameters: &[parameter("mu", 1.0, 0.001, 50.0)],
        variables: &["y", "z"],
        start: &[2.0, 0.0],
        scale: |p| vec![2.0, 2.0_f64.max(1.5 * p[0])],
        cycle: |p| TAU.max(1.614 * p[0] + 3.5),
        rate: |p| 1.0 + 3.0 * p[0],
        build: |kind, p, step| Ok(model(VanDerPol { mu: p[0] }, kind, &(kind.scale)(p), step)),
    },
    Kind {
        name: "hopf",
        what: "Hopf oscillator, whose amplitude is the root of square_radius",
        time_unit: "units of time",
        parameters: &[
            parameter("gain", 1.0, 0.001, 100.0),
            parameter("square_radius", 1.0, -10.0, 10.0),
            parameter("frequency", TAU, 0.01, 100.0),
        ],
        variables: &["x", "y"],
        start: &[1.0, 0.0],
        scale: |p| vec![p[1].abs().sqrt().max(0.1); 2],
        cycle: |p| TAU / p[2],
        rate: |p| p[2] + 2.0 * p[0] * p[1].abs(),
        build: |kind, p, step| {
            let flow = Hopf { gain: p[0], square_radius: p[1], frequency: p[2] };
            Ok(model(flow, kind, &(kind.scale)(p), step))
        },
    },
    Kind {
        name: "rayleigh",
        what: "Rayleigh oscillator of the thesis; states in its closed-form amplitudes",
        time_unit: "s",
        parameters: &[
            parameter("alpha", 0.2, 1e-6, 1000.0),
            parameter("p", 5.0, 1e-12, 1e6),
            parameter("mu", 1.0, 0.01, 100.0),
        ],
        variables: &["angle.displacement", "angle.velocity"],
        start: &[1.0, 0.0],
        scale: |_| vec![1.0; 2],
        cycle: |p| TAU / p[2] + 1.614 * p[0] / (p[2] * p[2]),
        // Its `build` allows a tenth of mu's time, and is strict on the damping far outside of the cycle.
        rate: |p| 5.0 * p[2] + 10.0 * p[0],
        build: |_, p, step| {
            let config = RayleighConfig { alpha: p[0], p: p[1], mu: p[2], offset: 0.0 };
            let period = Period::from_micros((step * 1e6) as u32).ok_or("no such step")?;
            Ok(network(config.build::<Rk4>(period).map_err(|error| error.to_string())?, ["angle"]))
        },
    },
    Kind {
        name: "fitzhugh-nagumo",
        what: "FitzHugh-Nagumo neuron",
        time_unit: "units of time",
        parameters: &[
            parameter("current", 0.5, -10.0, 10.0),
            parameter("slowness", 0.08, 1e-3, 1.0),
            parameter("offset", 0.7, -2.0, 2.0),
            parameter("leak", 0.8, 0.0, 2.0),
        ],
        variables: &["v", "w"],
        start: &[1.0, 0.0],
        scale: |_| vec![2.0, 0.8],
        cycle: |p| 40.0 * (0.08 / p[1]),
        rate: |p| 3.0 + p[1],
        build: |kind, p, step| {
            let flow = FitzHughNagumo { current: p[0], slowness: p[1], offset: p[2], leak: p[3] };
            Ok(model(flow, kind, &(kind.scale)(p), step))
        },
    },
    Kind {
        name: "morris-lecar",
        what: "Morris-Lecar neuron, in mV and ms",
        time_unit: "ms",
        parameters: &[parameter("current", 100.0, -500.0, 1000.0)],
        variables: &["V", "n"],
        start: &[-20.0, 0.3],
        scale: |_| vec![40.0, 0.2],
        cycle: |_| 85.0,
        rate: |_| 1.0,
        build: |kind, p, step| Ok(model(MorrisLecar { current: p[0] }, kind, &(kind.scale)(p), step)),
    },
    Kind {
        name: "terman-wang",
        what: "Terman-Wang relaxation oscillator",
        time_unit: "units of time",
        parameters: &[
            parameter("current", 0.8, -10.0, 10.0),
            parameter("slowness", 0.02, 1e-3, 1.0),
            parameter("height", 6.0, 0.1, 100.0),
            parameter("width", 0.1, 0.01, 10.0),
        ],
        variables: &["x", "y"],
        start: &[-1.5, 1.0],
        scale: |p| vec![2.0, 0.4 * p[2]],
        cycle: |p| 2.5 / p[1],
        rate: |_| 10.0,
        build: |kind, p, step| {
            let flow = TermanWang { current: p[0], slowness: p[1], height: p[2], width: p[3] };
            Ok(model(flow, kind, &(kind.scale)(p), step))
        },
    },
    Kind {
        name: "matsuoka",
        what: "two Matsuoka neurons that inhibit each other",
        time_unit: "units of time",
        parameters: &[
            parameter("weight", 2.5, 0.0, 100.0),
            parameter("fatigue", 2.5, 0.0, 100.0),
            parameter("rise", 1.0, 0.01, 100.0),
            parameter("adaptation", 12.0, 0.01, 1000.0),
            parameter("tonic", 1.0, 0.01, 100.0),
        ],
        variables: &["x1", "x2", "v1", "v2"],
        start: &[0.5, -0.5, 0.2, 0.2],
        scale: |p| [0.8, 0.8, 0.1, 0.1].map(|scale| scale * p[4]).to_vec(),
        cycle: |p| TAU * (p[2] * p[3]).sqrt(),
        rate: |p| (1.0 + p[0] + p[1]) / p[2] + 1.0 / p[3],
        build: |kind, p, step| {
            let pair = Matsuoka {
                rise: p[2],
                adaptation: p[3],
                fatigue: p[1],
                tonic: p[4],
                inhibition: [[0.0, p[0]], [p[0], 0.0]],
                input: [0.0; 2],
            };
            Ok(model(pair, kind, &(kind.scale)(p), step))
        },
    },
];
