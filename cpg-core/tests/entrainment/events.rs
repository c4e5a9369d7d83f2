//! Events of the stride on synthetic walkers: what a good one brings, and what the worst one can do.

use cpg_core::entrainment::phase_lock::Template;
use cpg_core::entrainment::{EventSource, Follower, FollowerConfig, Lock, SensorFault};
use cpg_core::{Follow, Generator};
use joint_units::{Joint, Period, Phase, Radians};

use crate::walker::{Walker, templates, walk};

/// Where the heel strikes, in cycles of the templates; nobody is told.
const STRIKE: f64 = 0.86;

fn legs_with(events: EventSource, sensor: Joint) -> Follower {
    let config = FollowerConfig { events, ..FollowerConfig::default() };
    config.build(templates(), sensor, Period::MILLISECOND).unwrap()
}

/// What the switch does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Switch {
    /// It closes so many milliseconds late, and bounces for 20 ms.
    Sound(f64),
    /// It misses every other strike.
    Misses,
    /// 100 times a second.
    Bouncing,
    /// At random, so many times a second.
    Random(f64),
    /// With a period of its own, s.
    Clock(f64),
    /// Never.
    Open,
}

struct Foot {
    switch: Switch,
    seed: u32,
    ticks: u32,
    strikes: u32,
    since: u32,
}

impl Foot {
    fn new(switch: Switch, seed: u32) -> Self {
        Self {
            switch,
            seed: seed.wrapping_mul(747_796_405).wrapping_add(1),
            ticks: seed % 1000,
            strikes: 0,
            since: u32::MAX / 2,
        }
    }

    /// Whether it closes in the tick that the walker has just made.
    fn closes(&mut self, walker: &Walker) -> bool {
        self.seed = self.seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.ticks, self.since) = (self.ticks + 1, self.since + 1);
        let late_s = if let Switch::Sound(late_ms) = self.switch { late_ms * 1e-3 } else { 0.0 };
        let now = walker.cycles - STRIKE - late_s * walker.rate;
        let strikes = now.floor() > (now - walker.rate * 1e-3).floor();
        self.strikes += u32::from(strikes);
        if strikes {
            self.since = 0;
        }
        match self.switch {
            Switch::Sound(_) => strikes || (self.since < 20 && self.since.is_multiple_of(4)),
            Switch::Misses => strikes && self.strikes.is_multiple_of(2),
            Switch::Bouncing => self.ticks.is_multiple_of(10),
            Switch::Random(per_s) => f64::from(self.seed) < per_s * 1e-3 * f64::from(u32::MAX),
            Switch::Clock(period_s) => self.ticks.is_multiple_of((period_s * 1e3) as u32),
            Switch::Open => false,
        }
    }
}

/// Walks with a sensor or without, and with the switch.
fn tread(legs: &mut Follower, walker: &mut Walker, foot: &mut Foot, sensed: bool, ticks: u32) {
    for _ in 0..ticks {
        let angle = walker.tick();
        if foot.closes(walker) {
            legs.heel_strike();
        }
        legs.observe(sensed.then_some(angle));
        legs.step();
    }
}

/// While the angle is good a switch changes nothing, to the bit: neither a sound one nor one that has gone mad.
#[test]
fn a_lock_is_what_it_is_without_a_switch() {
    for switch in [Switch::Sound(0.0), Switch::Bouncing, Switch::Random(1.0), Switch::Random(20.0), Switch::Clock(0.8)]
    {
        for (seed, sensor) in [(1, Joint::LeftHip), (2, Joint::RightKnee)] {
            let (mut plain, mut with) =
                (legs_with(EventSource::None, sensor), legs_with(EventSource::FootSwitch, sensor));
            let (mut walker, mut foot) = (Walker::new(sensor, 1.02), Foot::new(switch, seed));
            for tick in 0..20_000 {
                if tick == 12_000 {
                    walker.wanted = 1.0 / 0.9;
                }
                let angle = walker.tick();
                plain.observe(Some(angle));
                plain.step();
                if foot.closes(&walker) {
                    // Without a source they are not even listened to.
                    plain.heel_strike();
                    with.heel_strike();
                }
                with.observe(Some(angle));
                with.step();
                assert_eq!((with.angles(), with.rates()), (plain.angles(), plain.rates()), "{switch:?}, tick {tick}");
                assert_eq!(with.phase_lock(), plain.phase_lock(), "{switch:?}, tick {tick}");
                assert_eq!(with.follow_status(), Some(plain.status()), "{switch:?}, tick {tick}");
            }
            assert_eq!((with.status().state, plain.event_phase()), (Lock::Locked, None));
        }
    }
}

/// Where the heel strikes is learned from four strikes in a lock, to 2 degrees, however late the switch is; a switch that is not the heel's is
/// never believed.
#[test]
fn the_place_of_the_strike_is_learned() {
    for late_ms in [0.0, 45.0, 300.0] {
        let mut legs = legs_with(EventSource::FootSwitch, Joint::LeftHip);
        let (mut walker, mut foot) = (Walker::new(Joint::LeftHip, 1.05), Foot::new(Switch::Sound(late_ms), 1));
        let mut strikes_locked = 0;
        for tick in 0..20_000 {
            let before = foot.strikes;
            let locked = legs.status().state == Lock::Locked;
            tread(&mut legs, &mut walker, &mut foot, true, 1);
            strikes_locked += u32::from(locked && foot.strikes > before);
            assert!(strikes_locked >= 4 || legs.event_phase().is_none(), "tick {tick}");
            assert!(strikes_locked < 5 || legs.event_phase().is_some(), "tick {tick}");
        }
        let truth = Phase::from_cycles((STRIKE + late_ms * 1e-3 / 1.05).fract() as f32);
        let off = truth.radians_after(legs.event_phase().unwrap()).0.to_degrees();
        assert!(off.abs() < 2.0, "{late_ms} ms late: {off} degrees");
        let fresh = legs_with(EventSource::FootSwitch, Joint::LeftHip);
        legs.reset();
        assert_eq!(legs, fresh);
    }
    for switch in [Switch::Bouncing, Switch::Random(20.0), Switch::Clock(0.8), Switch::Clock(0.3), Switch::Open] {
        let mut legs = legs_with(EventSource::FootSwitch, Joint::LeftHip);
        let (mut walker, mut foot) = (Walker::new(Joint::LeftHip, 1.05), Foot::new(switch, 7));
        for tick in 0..40_000 {
            tread(&mut legs, &mut walker, &mut foot, true, 1);
            assert_eq!(legs.event_phase(), None, "{switch:?}, tick {tick}");
        }
    }
}

/// Error of the driven phase in degrees, the largest and the last of 2 s without the sensor, of a walker whose cadence changes by this
/// part when it is lost; and the same legs after it.
fn lost(first: Switch, then: Switch, seed: u32, change: f64) -> (f32, f32, Follower, Walker) {
    let mut legs = legs_with(EventSource::FootSwitch, Joint::LeftHip);
    let (mut walker, mut foot) = (Walker::new(Joint::LeftHip, 1.1), Foot::new(first, seed));
    tread(&mut legs, &mut walker, &mut foot, true, 12_000 + 37 * (seed % 30));
    (walker.wanted, walker.haste_s, foot.switch) = (walker.wanted * (1.0 + change), 3.0, then);
    let mut worst = 0.0f32;
    for tick in 0..2000 {
        tread(&mut legs, &mut walker, &mut foot, false, 1);
        let state = legs.status();
        assert!(tick < 25 || (state.state, state.fault) == (Lock::Holding, Some(SensorFault::Missing)), "tick {tick}");
        worst = worst.max(walker.off(legs.phase()).abs());
    }
    let last = walker.off(legs.phase()).abs();
    (worst, last, legs, walker)
}

/// A walker who gets slower or faster while nothing is sensed is followed by the strikes, also by every other of them.
#[test]
fn a_switch_keeps_the_phase_through_a_loss() {
    for change in [-0.08, 0.08] {
        for seed in 0..30 {
            let (_, without, ..) = lost(Switch::Open, Switch::Open, seed, change);
            let (_, with, ..) = lost(Switch::Sound(30.0), Switch::Sound(30.0), seed, change);
            assert!(without > 25.0 && with < 0.75 * without, "seed {seed}, {change}: {with} for {without} degrees");
        }
        let (mut with, mut without) = (0.0, 0.0);
        for seed in 0..30 {
            without += lost(Switch::Open, Switch::Open, seed, change).1 / 30.0;
            with += lost(Switch::Sound(0.0), Switch::Misses, seed, change).1 / 30.0;
        }
        assert!(with < 0.8 * without, "{change}, every other strike: {with} for {without} degrees");
    }
    // Nothing changes: the strikes do no harm.
    let (worst, ..) = lost(Switch::Sound(0.0), Switch::Sound(0.0), 5, 0.0);
    assert!(worst < 4.0, "{worst} degrees");
}

/// The switch was sound, and goes mad when the sensor is lost: the phase is off by no more than a tenth of a stride and a twentieth of
/// the cadence over 2 s, whenever it strikes; and when the sensor is back, it is followed as ever.
#[test]
fn a_mad_switch_is_bounded() {
    let mut worst = 0.0f32;
    let mad = [
        Switch::Bouncing,
        Switch::Random(1.0),
        Switch::Random(5.0),
        Switch::Random(100.0),
        Switch::Clock(0.9),
        Switch::Clock(0.62),
    ];
    for switch in mad {
        for seed in 0..40 {
            let (off, _, mut legs, mut walker) = lost(Switch::Sound(0.0), switch, seed, 0.0);
            worst = worst.max(off);
            let mut foot = Foot::new(switch, seed + 1);
            tread(&mut legs, &mut walker, &mut foot, true, 3500);
            assert_eq!(legs.status().state, Lock::Locked, "{switch:?}, seed {seed}");
            assert!(walker.off(legs.phase()).abs() < 4.0, "{switch:?}, seed {seed}");
        }
    }
    println!("worst phase error of a mad switch: {worst} degrees");
    assert!(worst < 40.0, "{worst} degrees");

    // The cleverest: it strikes where it does most harm, just inside what is believed, on and on.
    for ahead in [-0.09, 0.09] {
        let mut legs = legs_with(EventSource::FootSwitch, Joint::LeftHip);
        let (mut walker, mut foot) = (Walker::new(Joint::LeftHip, 1.1), Foot::new(Switch::Sound(0.0), 1));
        tread(&mut legs, &mut walker, &mut foot, true, 15_000);
        let place = legs.event_phase().unwrap().cycles() + ahead;
        let mut before = 0.0;
        for _ in 0..2000 {
            walker.tick();
            let way = (legs.phase_lock().phase().cycles() - place).rem_euclid(1.0);
            if way < before - 0.5 {
                legs.heel_strike();
            }
            before = way;
            legs.observe(None);
            legs.step();
            let off = walker.off(legs.phase()).abs();
            assert!(off < 36.0 + 0.05 * 360.0 * 2.0 / 1.1, "{ahead}: {off} degrees");
        }
        let off = walker.off(legs.phase_lock().phase()).abs();
        assert!(off > 30.0, "{ahead}: it does no harm, {off} degrees: the test is none");
    }
}

/// However well a foot switch works, it leads nothing alone: the joints stand 2 s after the sensor is lost, and never walk without it.
#[test]
fn a_switch_leads_nothing_alone() {
    let mut legs = legs_with(EventSource::FootSwitch, Joint::LeftHip);
    let (mut walker, mut foot) = (Walker::new(Joint::LeftHip, 1.1), Foot::new(Switch::Sound(0.0), 1));
    tread(&mut legs, &mut walker, &mut foot, false, 8000);
    assert_eq!((legs.status().state, legs.amplitude()), (Lock::Stopped, 0.0));
    tread(&mut legs, &mut walker, &mut foot, true, 10_000);
    assert_eq!(legs.status().state, Lock::Locked);
    tread(&mut legs, &mut walker, &mut foot, false, 2700);
    assert_eq!((legs.status().state, legs.amplitude()), (Lock::Stopped, 0.0));
}

/// Milliseconds until the estimate is within 18 degrees and 3 % for good, of 100 starts, sorted.
fn starts(events: EventSource, sensor: Joint) -> Vec<u32> {
    let start = |n: u32| {
        let mut config = FollowerConfig { events, ..FollowerConfig::default() };
        config.lock.stride_s = 1.1 / [0.6, 0.8, 1.0, 1.2, 1.4][n as usize % 5];
        let mut legs = config.build(templates(), sensor, Period::MILLISECOND).unwrap();
        let mut walker = Walker::new(sensor, 1.1);
        walker.cycles = f64::from(n / 5) / 20.0;
        let mut last_bad = 0;
        for tick in 0..9000 {
            walk(&mut legs, &mut walker, 1);
            let slow = legs.phase_lock().frequency().0 * 1.1 / core::f32::consts::TAU - 1.0;
            if walker.off(legs.phase_lock().phase()).abs() > 18.0 || slow.abs() > 0.03 {
                last_bad = tick;
            }
        }
        assert!(last_bad < 8000 && legs.status().state == Lock::Locked, "{events:?}, {sensor:?}, start {n}");
        last_bad
    };
    let mut all: Vec<u32> = (0..100).map(start).collect();
    all.sort_unstable();
    all
}

/// The peaks of a knee find it sooner in the median of 100 starts, and from everywhere as without them.
#[test]
fn peaks_of_a_knee_find_it_sooner() {
    let [without, with] = [EventSource::None, EventSource::Peak].map(|events| starts(events, Joint::LeftKnee));
    println!("knee: {} and {} ms median, {} and {} ms worst", without[50], with[50], without[99], with[99]);
    assert!(with[50] + 150 < without[50] && with[99] < 4500);
    let with = starts(EventSource::Peak, Joint::RightHip);
    println!("hip with peaks: {} ms median, {} ms worst", with[50], with[99]);
    assert!(with[99] < 4000);
}

/// A template without one peak a stride is refused by name, with peaks as the source only.
#[test]
fn peaks_that_are_none_or_two_are_refused() {
    let shape = |first: f32, second: f32| {
        let (mut cos, sin) = ([0.0; 8], [0.0; 8]);
        (cos[0], cos[1]) = (first, second);
        Template::new(Radians(0.1), cos, sin).unwrap()
    };
    for (template, name) in [(shape(0.012, 0.0), "template.range"), (shape(0.05, 0.3), "template.peaks")] {
        let build = |events| {
            let config = FollowerConfig { events, ..FollowerConfig::default() };
            config.build([template; 4], Joint::RightHip, Period::MILLISECOND)
        };
        let error = build(EventSource::Peak).unwrap_err().to_string();
        assert!(error.contains(name), "{error} does not name {name}");
        assert!(build(EventSource::None).is_ok() && build(EventSource::FootSwitch).is_ok());
    }
}
