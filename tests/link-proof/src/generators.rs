//! Generators in the link proof: each is built from any configuration and period, then all functions that a tick calls are called.

use core::hint::black_box;

use cpg_core::edge_reversal::hexapod::{Hexapod, Orientation};
use cpg_core::edge_reversal::obb::{Obb, Reversibilities};
use cpg_core::edge_reversal::smer::{Edge, Smer};
use cpg_core::entrainment::phase_lock::{TEMPLATE_HARMONICS, Template};
use cpg_core::entrainment::stride_events::{PeakConfig, StrideEventConfig};
use cpg_core::entrainment::{AdaptiveHopfConfig, FollowerConfig};
use cpg_core::gait::catalogue;
use cpg_core::gait::catalogue::Visitor;
use cpg_core::gait::default_walk::{default_config, default_walk};
use cpg_core::gait::family::{FamilyGait, FirstLeg, Member};
use cpg_core::gait::named::Gait;
use cpg_core::gait::six_and_eight_joints;
use cpg_core::joints::features::Features;
use cpg_core::joints::hexapod_legs::HexapodWalkConfig;
use cpg_core::joints::linear::{PhasePlane, ReadoutConfig};
use cpg_core::math::first_order::Flow;
use cpg_core::math::trig;
use cpg_core::network::graph::Biped;
use cpg_core::network::phase_coupled::Robust;
use cpg_core::network::symmetric_cells::{
    CellLink, LegGait, LegNetwork, NeuronLegNetwork, QuadrupedGait, QuadrupedNetwork,
};
use cpg_core::network::thesis::{Thesis, ThesisConfig};
use cpg_core::oscillator::half_centre;
use cpg_core::oscillator::hopf::AdaptiveHopf;
use cpg_core::oscillator::hu::HuConfig;
use cpg_core::oscillator::kuo::{Drive, KuoConfig, Measurement, Pendulum};
use cpg_core::oscillator::matsuoka::Matsuoka;
use cpg_core::oscillator::rayleigh::{Rayleigh, RayleighConfig};
use cpg_core::transition::{JointLimits, TransitionConfig};
use cpg_core::waveform::adaptive_fourier::{AdaptiveFourierConfig, AdaptiveWalkConfig};
use cpg_core::waveform::fixed::FixedPhaseShapeConfig;
use cpg_core::waveform::hopf_bank::ProgrammableConfig;
use cpg_core::waveform::shape::{Adjustment, FourierShape, PhaseShapeConfig, SplineShape};
use cpg_core::{BuildError, Follow, Generator, SemiImplicitEuler};
use joint_units::{Joint, Period, Phase, Radians};

pub(crate) fn prove(period: Period) {
    run(default_walk(period));
    run::<4, Robust<Biped, 4, 4>>(black_box(default_config()).build(period));
    run::<4, Robust<Biped, 4, 4, f32, SemiImplicitEuler>>(black_box(default_config()).build(period));
    run(black_box(default_config()).build_fixed::<Biped>(period));
    run(six_and_eight_joints::with_ankles(period));
    run(six_and_eight_joints::with_arms(period));
    let rayleigh: RayleighConfig = black_box(RayleighConfig { alpha: 0.2, p: 5.0, mu: 1.0, offset: 10.0 });
    run::<1, Rayleigh>(rayleigh.build(period));
    run::<4, Thesis>(black_box(ThesisConfig::set_s()).build(period));
    catalogue::each(period, &mut CatalogueProof);
    flows(period);
    gaits(period);
    shapes(period);
    changes(period);
    integers(period);
    learners(period);
    sensed(period);
    followers(period);
}

fn run<const N: usize, G: Generator<N>>(built: Result<G, BuildError>) {
    let Ok(generator) = built else { return };
    let mut generator = black_box(generator);
    generator.step();
    let _ =
        black_box((generator.angles(), generator.rates(), generator.phase(), generator.amplitude(), generator.check()));
    generator.reset();
    black_box(&generator);
}

/// Visits the catalogue, which includes all oscillators: van der Pol, both Hopf, Matsuoka, FitzHugh-Nagumo, Morris-Lecar, Terman-Wang, ...
struct CatalogueProof;

impl Visitor for CatalogueProof {
    fn generator<G: Generator<4> + Features + Clone>(&mut self, _: &'static str, built: Result<G, BuildError>) {
        if let Ok(walk) = &built {
            let mut features = [0.0; 16];
            black_box(walk).features(black_box(features.as_mut_slice()));
            black_box(features);
        }
        run(built);
    }
}

/// Any differential equation, with any read-out of four joints and any phase plane.
fn flow<F: Flow<f32, D>, const D: usize>(flow: F, period: Period) {
    let config = ReadoutConfig {
        start: black_box([0.1; D]),
        cycle: black_box(1.0),
        stride_s: black_box(1.1),
        weights: black_box([[0.1; D]; 4]),
        offsets: black_box([Radians(0.1); 4]),
        plane: PhasePlane {
            x: black_box(0),
            y: black_box(1),
            centre: black_box((0.0, 0.0)),
            radius: black_box((1.0, 1.0)),
        },
        bound: black_box(5.0),
    };
    if let Ok(mut readout) = config.build(black_box(flow), period) {
        readout.set_state(black_box([0.2; D]));
        black_box(readout.flow_mut());
        run(Ok(readout));
    }
}

fn flows(period: Period) {
    flow(AdaptiveHopf { gain: 8.0, square_radius: 1.0, learning: 0.9, input: 0.3 }, period);
    flow(Matsuoka::<2>::standard([[0.5; 2]; 2]), period);
    flow(Matsuoka::<3>::standard([[0.5; 3]; 3]), period);
    flow(half_centre::legs(), period);
    flow(Matsuoka::<6>::standard([[0.5; 6]; 6]), period);
    flow(LegNetwork::of(black_box(LegGait::Skip)), period);
    let neuron = cpg_core::oscillator::fitzhugh_nagumo::FitzHughNagumo::standard(0.5);
    flow(NeuronLegNetwork { neuron, couplings: [0.02; 3] }, period);
    flow(QuadrupedNetwork::of(black_box(QuadrupedGait::Jump)), period);
    black_box(CellLink { linear: 0.3, harmonic: 0.1 });
    run(half_centre::flexor_extensor(black_box(1.1), black_box(Radians(0.3)), black_box(Radians(0.1)), period));
}

fn gaits(period: Period) {
    for gait in Gait::ALL {
        if let Ok(built) = black_box(gait).build(black_box(1.0), period) {
            run(Ok(built.aligned(black_box(Phase(7)), period)));
        }
    }
    black_box(Gait::from_name(black_box("walk")).map(Gait::name));
    let _ = black_box(black_box(Gait::Thesis).speed_at(black_box(100.0)));
    let _ = black_box(
        black_box(Gait::Human(Member::Run)).allow_speed(black_box(1.0), &black_box([JointLimits::WIDEST; 4])),
    );
    let limits = black_box([JointLimits::WIDEST; 4]);
    let Ok(family) = FamilyGait::build(black_box(Member::Walk), black_box(110.0), limits, period) else { return };
    let mut family = black_box(family);
    family.start(black_box(FirstLeg::Right));
    let _ = black_box(family.set_cadence(black_box(120.0)));
    let _ = black_box(family.change(black_box(Member::Run), black_box(160.0)));
    family.stop();
    black_box((family.is_standing(), family.member(), family.cadence()));
    run(Ok(family));
}

fn shapes(period: Period) {
    let angle = || black_box(Radians(0.1));
    let stride_s = black_box(1.1);
    let adjustment = || black_box(Adjustment { gain: 1.0, offset: Radians(0.1), lead: Phase(7) });
    if let Ok(shape) = FourierShape::<3>::new(angle(), black_box([0.1; 3]), black_box([0.1; 3])) {
        let config = PhaseShapeConfig { shapes: [shape; 4], stride_s };
        if let Ok(mut built) = config.build(period) {
            let _ = black_box(built.set_stride(black_box(0.9)));
            let _ = black_box(built.adjust(black_box(2), adjustment()));
            built.set_phase(black_box(Phase(9)));
            run(Ok(built));
        }
        let config = FixedPhaseShapeConfig { shapes: [shape; 4], leads: black_box([Phase(3); 4]), stride_s };
        if let Ok(mut built) = config.build(period) {
            let _ = black_box(built.set_stride(black_box(0.9)));
            let _ = black_box(built.adjust(black_box(2), adjustment()));
            built.set_phase(black_box(Phase(9)));
            run(Ok(built));
        }
    }
    if let Ok(shape) = SplineShape::<8>::new(black_box([Radians(0.1); 8])) {
        run(PhaseShapeConfig { shapes: [shape; 4], stride_s }.build(period));
    }
    black_box((trig::sin_cos(black_box(Phase(5))), trig::angle(black_box(0.1), black_box(0.2))));
}

fn changes(period: Period) {
    let Ok(walk) = default_walk(period) else { return };
    let limits = black_box([JointLimits::WIDEST; 4]);
    let Ok(smooth) = black_box(TransitionConfig::default()).build(walk, limits, period) else { return };
    let mut smooth = black_box(smooth);
    smooth.change(|walk| walk.reset());
    black_box(smooth.stop(black_box([Radians(0.0); 4])).is_ok());
    smooth.step();
    smooth.resume();
    run(Ok(smooth));
}

fn integers(period: Period) {
    if let Ok(reversibilities) = Reversibilities::new(black_box(1), black_box(2)) {
        let mut obb = black_box(Obb::new(reversibilities));
        black_box(obb.step());
        black_box(obb.potentials());
        black_box(Obb::from_potential(reversibilities, black_box(0.35)).is_ok());
        obb.set(black_box(reversibilities));
        black_box(&obb);
    }
    if let Ok(hexapod) = Hexapod::new(black_box(3)) {
        let mut hexapod = black_box(hexapod);
        black_box(hexapod.step());
        let _ = black_box(hexapod.set_reversibility(black_box(1)));
        black_box((hexapod.circulation(), hexapod.period()));
        black_box(&hexapod);
    }
    if let Ok(orientation) = black_box("dd-du-lrr").parse::<Orientation>() {
        black_box((orientation.directed_cycle(), orientation.start_order()));
        black_box(Hexapod::with_orientation(black_box(3), orientation).is_ok());
    }
    let config = HexapodWalkConfig { reversibility: black_box(5), ..black_box(HexapodWalkConfig::default()) };
    if let Ok(walk) = config.build(period) {
        let mut walk = black_box(walk);
        let _ = black_box(walk.set_reversibility(black_box(1)));
        run(Ok(walk));
    }
    let edges = black_box([(0, 1), (1, 2), (2, 0)]).map(|(a, b)| Edge { a, b, tokens_at_a: black_box(1) });
    if let Ok(graph) = Smer::new(black_box([1, 2, 3]), edges) {
        let mut graph = black_box(graph);
        black_box(graph.step());
        black_box((graph.is_forest(), graph.is_acyclic(), graph.cycle().is_ok()));
        black_box(graph.circulation(black_box(&[0, 1, 2])));
    }
}

fn learners(period: Period) {
    if let Ok(learner) = black_box(AdaptiveFourierConfig::default()).build::<5>(period) {
        let mut learner = black_box(learner);
        black_box(learner.learn(black_box(0.1)));
        learner.play();
        black_box((learner.value(), learner.phase(), learner.frequency_hz()));
    }
    let config = AdaptiveWalkConfig { learner: black_box(AdaptiveFourierConfig::default()), unit: black_box(0.5) };
    if let Ok(mut walk) = config.build::<6, 4>(period) {
        walk.learn(black_box([Radians(0.1); 4]));
        run(Ok(walk));
    }
    let config = black_box(ProgrammableConfig::<4>::harmonics_of(0.9));
    if let Ok(learner) = config.build(period) {
        let mut learner = black_box(learner);
        black_box(learner.learn(black_box(0.1)));
        learner.play();
        black_box((learner.value(), learner.frequencies_hz(), learner.amplitudes()));
    }
}

/// Generators that use a measurement: Kuo's pendulum and Hu's joint.
fn sensed(period: Period) {
    for drive in [Drive::FeedForward, Drive::Feedback, Drive::Hybrid { gain: [0.5; 2] }] {
        let config: KuoConfig = black_box(KuoConfig { damping: 0.1, amplitude: 1.0, drive });
        if let Ok(control) = config.build(black_box(0.01)) {
            let mut control = black_box(control);
            let kick = black_box(control.step(&black_box(Measurement { angle: 0.1, rate: 0.2, valid: true })));
            if let Ok(limb) = Pendulum::new(black_box(0.1)) {
                let mut state = black_box([0.5, 0.1]);
                limb.advance(&mut state, black_box(0.01), kick.as_ref());
                black_box(state);
            }
            control.reset();
            black_box((control.estimate(), control.impulse()));
        }
    }
    let config: HuConfig = black_box(HuConfig::standard(1.5, 1.0));
    if let Ok(joint) = config.build(period) {
        let mut joint = black_box(joint);
        joint.step();
        black_box((joint.angle(), joint.rate(), joint.rates(), joint.potentials()));
        joint.reset();
        black_box(&joint);
    }
}

/// Followers: the entrained joints, and the estimators that they do not use.
fn followers(period: Period) {
    let shape = |mean| {
        Template::new(black_box(mean), black_box([0.1; TEMPLATE_HARMONICS]), black_box([0.1; TEMPLATE_HARMONICS]))
    };
    if let (Ok(hip), Ok(knee)) = (shape(Radians(0.1)), shape(Radians(0.5))) {
        let config = black_box(FollowerConfig::default());
        if let Ok(mut walk) = config.build([hip, hip, knee, knee], black_box(Joint::LeftHip), period) {
            walk.observe(black_box(Some(Radians(0.1))));
            walk.heel_strike();
            black_box((walk.follow_status(), walk.event_phase(), walk.acceleration_bound(black_box(Joint::LeftKnee))));
            run(Ok(walk));
        }
    }
    if let Ok(estimator) = black_box(AdaptiveHopfConfig::default()).build(period) {
        let mut estimator = black_box(estimator);
        estimator.step(black_box(Radians(0.1)));
        black_box((estimator.phase(), estimator.frequency()));
    }
    if let Ok(events) = black_box(StrideEventConfig::default()).build(period) {
        let mut events = black_box(events);
        events.step();
        black_box(events.event(black_box(0.01)));
        black_box((events.phase(), events.frequency()));
    }
    if let Ok(peaks) = black_box(PeakConfig::default()).build(period) {
        let mut peaks = black_box(peaks);
        black_box(peaks.step(black_box(Radians(0.1))));
    }
}
