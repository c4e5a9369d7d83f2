//! Ten changes between the members of the family of gaits ([`cpg_core::gait::family`]), for an emulated Cortex-M4F and for the host.
//!
//! Both print one line for each change, `name hash word`: a hash of the angles of all joints in each of the 3,000 ticks after it, bit for bit,
//! and `inside`, or `outside` if a joint left its range or exceeded its rate on the default robot. `cargo xtask test --only gait-changes`
//! compares the lines.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod exit;
#[cfg(target_os = "none")]
mod semihosting;
#[cfg(target_os = "none")]
mod start;

use core::fmt::Arguments;

use cpg_core::gait::family::{FamilyGait, FirstLeg, Member};
use cpg_core::{BuildError, Generator};
use joint_loop::GateConfig;
use joint_units::Period;

/// Ticks after each change; some changes come before the one before is complete.
const TICKS: [u32; 3] = [3000, 150, 3000];

/// A change of the gait.
enum Change {
    Start(FirstLeg),
    Cadence(f32),
    To(Member, f32),
    Stop,
}

const CHANGES: [(&str, Change); 10] = [
    ("start-left", Change::Start(FirstLeg::Left)),
    ("walk-130", Change::Cadence(130.0)),
    ("run-160", Change::To(Member::Run, 160.0)),
    ("run-175", Change::Cadence(175.0)),
    ("walk-99", Change::To(Member::Walk, 99.0)),
    ("run-155", Change::To(Member::Run, 155.0)),
    ("stop", Change::Stop),
    ("start-right", Change::Start(FirstLeg::Right)),
    ("walk-120", Change::To(Member::Walk, 120.0)),
    ("stop-again", Change::Stop),
];

impl Change {
    fn make(&self, gait: &mut FamilyGait) -> Result<(), BuildError> {
        match *self {
            Change::Start(leg) => gait.start(leg),
            Change::Cadence(cadence) => gait.set_cadence(cadence)?,
            Change::To(member, cadence) => gait.change(member, cadence)?,
            Change::Stop => gait.stop(),
        }
        Ok(())
    }
}

/// Plays all changes and says a line for each.
fn play(mut say: impl FnMut(Arguments<'_>)) -> Result<(), BuildError> {
    let limits = GateConfig::default_biped().joint_limits();
    let mut gait = FamilyGait::build(Member::Walk, 110.0, limits, Period::MILLISECOND)?;
    for ((name, change), ticks) in CHANGES.iter().zip(TICKS.into_iter().cycle()) {
        change.make(&mut gait)?;
        // FNV-1a.
        let (mut hash, mut inside) = (0x811C_9DC5_u32, true);
        for _ in 0..ticks {
            let before = gait.angles();
            gait.step();
            for ((angle, before), limits) in gait.angles().iter().zip(before).zip(&limits) {
                for byte in angle.0.to_bits().to_le_bytes() {
                    hash = (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
                }
                let in_range = (limits.least.0..=limits.most.0).contains(&angle.0);
                // The difference of two angles rounds.
                let in_rate = (angle.0 - before.0).abs() <= limits.rate.0 * 1.001e-3;
                inside &= in_range && in_rate;
            }
        }
        say(format_args!("{name} {hash:08x} {}", if inside { "inside" } else { "outside" }));
    }
    Ok(())
}

/// Entry on the board.
#[cfg(target_os = "none")]
#[unsafe(no_mangle)]
extern "C" fn after_reset() -> ! {
    use core::fmt::Write as _;
    let played = play(|text| {
        let mut line = semihosting::TextLine::new();
        // A line is short.
        let _ = line.write_fmt(text);
        line.print();
    });
    exit::exit(u32::from(played.is_err()))
}

#[cfg(not(target_os = "none"))]
fn main() -> Result<(), BuildError> {
    play(|text| println!("{text}"))
}
