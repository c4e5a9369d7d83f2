//! Random changes of gait and speed, stops and restarts, within the limits of the default robot: ranges, rates and accelerations of the
//! joints, computed from differences of angles.

use cpg_core::Generator;
use cpg_core::gait::named::{DefaultGait, Gait};
use cpg_core::transition::{JointLimits, Smooth, TransitionConfig};
use joint_loop::GateConfig;
use joint_units::{Period, Phase, Radians};

const PERIOD: Period = Period::MILLISECOND;
const DT: f32 = 1e-3;

/// Gaits that are played, the first of [`Gait::ALL`], and their speeds. Those of persons are in `cpg-core/tests/smoothness.rs`.
const GAITS: u32 = 10;
const SPEEDS: (f32, f32) = (0.5, 1.5);

/// Changes of one sequence, most of which come while an earlier one still runs.
const CHANGES_A_SEQUENCE: u32 = 20;

/// Rounding of f32 in a second difference over 1 ms squared, angles up to 2 rad; an offset below a microradian is set to 0. rad/s^2.
const ROUNDING: f32 = 2.0;

/// Highest rate and acceleration of a joint.
#[derive(Debug, Clone, Copy, Default)]
struct Peak {
    rate: f32,
    acceleration: f32,
}

/// Rate and acceleration from three successive angles.
fn differences([before, now, next]: [f32; 3]) -> Peak {
    Peak { rate: (next - now).abs() / DT, acceleration: (next - 2.0 * now + before).abs() / (DT * DT) }
}

impl Peak {
    fn raise(&mut self, other: Peak) {
        self.rate = self.rate.max(other.rate);
        self.acceleration = self.acceleration.max(other.acceleration);
    }
}

/// The peaks of each joint of a gait by itself at speed 1.
fn alone(gait: Gait) -> [Peak; 4] {
    let mut generator = gait.build(1.0, PERIOD).expect("a gait");
    let mut peaks = [Peak::default(); 4];
    let mut past = [generator.angles(); 2];
    for tick in 0..20_000 {
        generator.step();
        let next = generator.angles();
        for (joint, peak) in peaks.iter_mut().enumerate().filter(|_| tick > 0) {
            peak.raise(differences([past[0][joint].0, past[1][joint].0, next[joint].0]));
        }
        past = [past[1], next];
    }
    peaks
}

/// The same at another speed: rates are proportional to it, accelerations to its square.
fn at_speed(peaks: [Peak; 4], speed: f32) -> [Peak; 4] {
    peaks.map(|peak| Peak { rate: peak.rate * speed, acceleration: peak.acceleration * speed * speed })
}

/// Numbers with a uniform distribution, from a 64-bit linear congruence (Knuth's constants).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as u32
    }

    fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.bits()) * u64::from(n)) >> 32) as u32
    }

    fn between(&mut self, least: f32, most: f32) -> f32 {
        least + (most - least) * (self.bits() as f32 / u32::MAX as f32)
    }
}

/// A gait at a speed, at a phase of its stride.
#[derive(Clone, Copy)]
struct Playing {
    gait: Gait,
    speed: f32,
    generator: DefaultGait,
}

impl Playing {
    fn at(gait: Gait, speed: f32, phase: Phase) -> Self {
        let generator = gait.build(speed, PERIOD).expect("a gait").aligned(phase, PERIOD);
        Self { gait, speed, generator }
    }
}

/// What happens at a change.
enum Event {
    Play(Box<Playing>),
    Stop([Radians; 4]),
    Resume,
}

/// Any pose inside the ranges and the pose limits.
fn pose(random: &mut Random, gate: &GateConfig) -> [Radians; 4] {
    loop {
        let pose = gate.range.map(|range| Radians(random.between(range.least.0, range.most.0)));
        if gate.pose.iter().flatten().all(|limit| limit.of(&pose).0 <= limit.most.0) {
            return pose;
        }
    }
}

impl Event {
    fn any(random: &mut Random, now: &Playing, phase: Phase, gate: &GateConfig) -> Self {
        // Of two cases one takes over at the present phase and one at any phase.
        let phase = if random.below(2) == 0 { phase } else { Phase(random.bits()) };
        let speed = random.between(SPEEDS.0, SPEEDS.1);
        match random.below(8) {
            0 => Event::Stop(pose(random, gate)),
            1 => Event::Resume,
            2 => Event::Play(Box::new(Playing::at(now.gait, speed, phase))),
            _ => Event::Play(Box::new(Playing::at(Gait::ALL[random.below(GAITS) as usize], speed, phase))),
        }
    }

    fn name(&self) -> String {
        match self {
            Event::Play(playing) => format!("{} at {:.2}", playing.gait.name(), playing.speed),
            Event::Stop(_) => "stop".into(),
            Event::Resume => "resume".into(),
        }
    }

    fn make(&self, smooth: &mut Smooth<DefaultGait, 4>) {
        match self {
            Event::Play(playing) => {
                smooth.resume();
                smooth.change(|generator| *generator = playing.generator);
            }
            Event::Stop(pose) => smooth.stop(*pose).expect("in range"),
            Event::Resume => smooth.resume(),
        }
    }
}

/// Largest values of many changes.
#[derive(Default)]
struct Worst {
    changes: u32,
    ticks: u64,
    /// Changes that without limits lead a joint out of its range.
    outside_without_limits: u32,
    /// Least distance to an end of a range, rad; below 0 outside.
    nearest: f32,
    rate: f32,
    acceleration: f32,
    /// Parts of the bounds.
    rate_part: f32,
    acceleration_part: f32,
    /// Largest excess over each pose limit, rad, and the number of changes that exceed one.
    pose: [f32; joint_loop::POSE_LIMITS],
    outside_pose: u32,
    /// Longest time over a pose limit, ticks.
    pose_ticks: u32,
    /// How far a joint would be out of its range without limits, rad.
    furthest: f32,
}

/// Runs a sequence of changes and asserts all bounds at every tick.
fn run(sequence: u64, own: &[[Peak; 4]], worst: &mut Worst) {
    let gate = GateConfig::default_biped();
    let limits = gate.joint_limits();
    let config = TransitionConfig::default();
    let place_of = |gait: Gait| Gait::ALL.iter().position(|other| *other == gait).expect("a gait");
    let mut random = Random(sequence);
    let mut now =
        Playing::at(Gait::ALL[random.below(GAITS) as usize], random.between(SPEEDS.0, SPEEDS.1), Phase(random.bits()));
    let mut smooth = config.build(now.generator, limits, PERIOD).expect("the default");
    let mut free = config.build(now.generator, [JointLimits::WIDEST; 4], PERIOD).expect("the default");
    let own_of = |playing: &Playing| at_speed(own[place_of(playing.gait)], playing.speed);
    // The motions that the output still has to do with: those since the last complete change.
    let mut motions = own_of(&now);
    let mut past = [smooth.angles(); 2];
    let mut started = false;
    let mut changes = vec![];
    let mut over_pose = 0;
    for change in 0..CHANGES_A_SEQUENCE {
        let event = Event::any(&mut random, &now, smooth.phase(), &gate);
        if !smooth.is_changing() {
            motions = own_of(&now);
        }
        if let Event::Play(next) = &event {
            now = **next;
            for (peak, other) in motions.iter_mut().zip(own_of(next)) {
                peak.raise(other);
            }
        }
        // One change in ten is followed by some on every tick.
        let burst = if random.below(10) == 0 { random.below(50) } else { 0 };
        let longest = [20, 200, 1000][random.below(3) as usize];
        let wait = random.below(longest) + burst + 1;
        let before = smooth.angles();
        event.make(&mut smooth);
        event.make(&mut free);
        assert_eq!(smooth.angles(), before, "sequence {sequence}, change {change}: a jump");
        changes.push(event.name());
        let mut outside = false;
        let mut pose_excess = f32::MIN;
        for tick in 0..wait {
            if tick < burst {
                // To and fro between a pose and the gait.
                for smooth in [&mut smooth, &mut free] {
                    match tick % 2 {
                        0 => smooth.stop(limits.map(|limits| limits.least)).expect("in range"),
                        _ => smooth.resume(),
                    }
                }
            }
            smooth.step();
            free.step();
            let next = smooth.angles();
            for joint in 0..4 {
                let (limits, angle) = (&limits[joint], next[joint].0);
                let seen = differences([past[0][joint].0, past[1][joint].0, angle]);
                let distance = (angle - limits.least.0).min(limits.most.0 - angle);
                let rate = limits.rate.0.max(motions[joint].rate);
                // 1 %: the thesis' network never repeats, so its peaks are not exactly those of the first 20 s.
                let acceleration = 1.01 * motions[joint].acceleration + config.acceleration.0;
                let place =
                    || format!("sequence {sequence}, change {change} ({}), tick {tick}, joint {joint}", event.name());
                assert!(distance >= 0.0, "{}: {angle} rad", place());
                assert!(seen.rate <= rate * 1.0005, "{}: {} over {rate} rad/s", place(), seen.rate);
                assert!(
                    !started || seen.acceleration <= acceleration + ROUNDING,
                    "{}: {} over {acceleration} rad/s^2",
                    place(),
                    seen.acceleration
                );
                worst.nearest = worst.nearest.min(distance);
                worst.rate = worst.rate.max(seen.rate);
                worst.rate_part = worst.rate_part.max(seen.rate / rate);
                if started {
                    worst.acceleration = worst.acceleration.max(seen.acceleration);
                    worst.acceleration_part = worst.acceleration_part.max(seen.acceleration / acceleration);
                }
                let loose = free.angles()[joint].0;
                let excess = (limits.least.0 - loose).max(loose - limits.most.0);
                outside |= excess > 0.0;
                worst.furthest = worst.furthest.max(excess);
            }
            let mut pose = f32::MIN;
            for (limit, most) in gate.pose.iter().zip(&mut worst.pose) {
                let over = limit.map_or(f32::MIN, |limit| limit.of(&next).0 - limit.most.0);
                *most = most.max(over);
                pose = pose.max(over);
            }
            pose_excess = pose_excess.max(pose);
            over_pose = if pose > 0.0 { over_pose + 1 } else { 0 };
            worst.pose_ticks = worst.pose_ticks.max(over_pose);
            past = [past[1], next];
            started = true;
            worst.ticks += 1;
        }
        worst.changes += 1;
        if pose_excess > 0.0 {
            worst.outside_pose += 1;
            let before = changes.iter().rev().skip(1).take(3).map(String::as_str).collect::<Vec<_>>().join(", ");
            println!(
                "sequence {sequence}, change {change} ({}, after {before}): {:.1} degrees over a pose limit",
                event.name(),
                pose_excess.to_degrees()
            );
        }
        worst.outside_without_limits += u32::from(outside);
    }
    // Every change ends: the output is the motion.
    if sequence.is_multiple_of(10) {
        (0..4000).for_each(|_| smooth.step());
        assert!(!smooth.is_changing(), "sequence {sequence}: the last change does not end");
    }
}

/// Runs `changes` changes, and prints the largest values.
fn run_all(changes: u32) -> Worst {
    let own = Gait::ALL.map(alone);
    let mut worst = Worst { nearest: f32::MAX, pose: [f32::MIN; joint_loop::POSE_LIMITS], ..Worst::default() };
    for sequence in 0..u64::from(changes / CHANGES_A_SEQUENCE) {
        run(sequence, &own, &mut worst);
    }
    println!(
        "{} changes, {} s of motion: every joint at least {:.2e} degrees inside its range; up to {:.1} degrees/s, {:.2} % of the bound; up to \
         {:.1} rad/s^2, {:.2} % of the bound. Without limits {} changes lead out of a range, by up to {:.1} degrees. \
         {} changes exceed a pose limit, for up to {} ms; the largest excesses are {:.1?} degrees",
        worst.changes,
        worst.ticks / 1000,
        worst.nearest.to_degrees(),
        worst.rate.to_degrees(),
        100.0 * worst.rate_part,
        worst.acceleration,
        100.0 * worst.acceleration_part,
        worst.outside_without_limits,
        worst.furthest.to_degrees(),
        worst.outside_pose,
        worst.pose_ticks,
        worst.pose.map(f32::to_degrees),
    );
    worst
}

#[test]
fn every_change_keeps_range_rate_and_acceleration() {
    let worst = run_all(5_000);
    assert!(worst.outside_without_limits > 100 && worst.acceleration_part > 0.9 && worst.rate_part > 0.9);
}

/// The same with many.
#[test]
#[ignore = "takes over a minute: cargo test -p footfall --test gait_changes -- --ignored --nocapture"]
fn a_hundred_thousand_changes_keep_range_rate_and_acceleration() {
    run_all(100_000);
}
