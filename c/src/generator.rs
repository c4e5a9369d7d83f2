//! Generators: gaits by name and generators of records, stepped from C.

use core::ffi::c_char;

use cpg_core::entrainment::FollowStatus;
use cpg_core::gait::named::{DefaultGait, Gait};
use cpg_core::{Follow, Generator};
use joint_loop::BoardGenerator;
use joint_loop::store::generator_record;
use joint_units::{Joint, Period, Radians};

use crate::error::{FootfallError, FootfallStatus, bytes, refuse, status_of, text};
use crate::slot;

/// Words of 8 bytes of a generator.
pub const FOOTFALL_GENERATOR_WORDS: usize = 384;

/// A generator of four joints. Its memory belongs to the caller, who sets it to zeros at first; it may be copied as a whole.
#[repr(C, align(16))]
#[derive(Debug, Clone, Copy)]
pub struct FootfallGenerator {
    /// No meaning for callers.
    pub words: [u64; FOOTFALL_GENERATOR_WORDS],
}

/// What a generator is.
#[derive(Clone, Copy)]
// There is no heap for the largest variant.
#[allow(clippy::large_enum_variant)]
enum Built {
    Board(BoardGenerator),
    Gait(DefaultGait),
}

const _: () = assert!(slot::fits::<Built>(FOOTFALL_GENERATOR_WORDS));

impl slot::Kind for Built {
    const MARK: u64 = u64::from_le_bytes(*b"ff_gen\0\0");
}

impl Built {
    fn step(&mut self) {
        match self {
            Self::Board(generator) => generator.step(),
            Self::Gait(generator) => generator.step(),
        }
    }

    fn reset(&mut self) {
        match self {
            Self::Board(generator) => generator.reset(),
            Self::Gait(generator) => generator.reset(),
        }
    }

    fn angles(&self) -> [f32; Joint::COUNT] {
        match self {
            Self::Board(generator) => generator.angles(),
            Self::Gait(generator) => generator.angles(),
        }
        .map(|angle| angle.0)
    }

    fn rates(&self) -> [f32; Joint::COUNT] {
        match self {
            Self::Board(generator) => generator.rates(),
            Self::Gait(generator) => generator.rates(),
        }
        .map(|rate| rate.0)
    }

    fn phase(&self) -> u32 {
        match self {
            Self::Board(generator) => generator.phase().0,
            Self::Gait(generator) => generator.phase().0,
        }
    }
}

/// The control period of so many microseconds.
fn period(micros: u32) -> Result<Period, (FootfallStatus, &'static str)> {
    Period::from_micros(micros).ok_or((FootfallStatus::Period, "period_us: allowed is 1 to 100000 us"))
}

/// Builds a gait by its name, such as `walk`, `natural-walk` or `human-walk`, at a factor `speed` on its own cadence, for a control period of
/// `period_us` microseconds. `error` may be null.
///
/// # Safety
/// `generator` is null or points to a generator, `name` is null or a text with a zero at its end, `error` is null or points to an error;
/// nobody else uses them during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_generator_gait(
    generator: *mut FootfallGenerator,
    name: *const c_char,
    speed: f32,
    period_us: u32,
    error: *mut FootfallError,
) -> FootfallStatus {
    // SAFETY: the caller guarantees the text.
    let gait = unsafe { text(name) }.and_then(Gait::from_name);
    let built = match (gait, period(period_us)) {
        (None, _) => Err((FootfallStatus::UnknownName, None, "name: allowed is a gait of `footfall walk --list`")),
        (_, Err((status, why))) => Err((status, None, why)),
        (Some(gait), Ok(period)) => gait.build(speed, period).map_err(|wrong| (status_of(&wrong), Some(wrong), "")),
    };
    match built {
        // SAFETY: the caller guarantees generator and error.
        Ok(built) => unsafe { filled(generator, Built::Gait(built), error) },
        // SAFETY: as above.
        Err((status, Some(wrong), _)) => unsafe { refuse(error, status, wrong) },
        // SAFETY: as above.
        Err((status, None, why)) => unsafe { refuse(error, status, why) },
    }
}

/// Builds the generator of a record of `length` bytes, as `footfall pack` writes it from a generator file, for a control period of `period_us`
/// microseconds. `error` may be null.
///
/// # Safety
/// `generator` is null or points to a generator, `record` is null or points to `length` bytes, `error` is null or points to an error;
/// nobody else uses them during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_generator_record(
    generator: *mut FootfallGenerator,
    record: *const u8,
    length: usize,
    period_us: u32,
    error: *mut FootfallError,
) -> FootfallStatus {
    // SAFETY: the caller guarantees the bytes.
    let Some(record) = (unsafe { bytes(record, length) }) else {
        // SAFETY: the caller guarantees the error.
        return unsafe {
            refuse(error, FootfallStatus::Record, "record is null; allowed are the bytes of `footfall pack`")
        };
    };
    let config = match generator_record::read(record) {
        Ok(Some(stored)) => stored.config,
        Ok(None) => {
            // SAFETY: as above.
            return unsafe {
                refuse(error, FootfallStatus::Record, "record is erased; allowed are the bytes of `footfall pack`")
            };
        }
        // SAFETY: as above.
        Err(wrong) => return unsafe { refuse(error, FootfallStatus::Record, wrong) },
    };
    let period = match period(period_us) {
        Ok(period) => period,
        // SAFETY: as above.
        Err((status, why)) => return unsafe { refuse(error, status, why) },
    };
    match config.build(period) {
        // SAFETY: the caller guarantees generator and error.
        Ok(built) => unsafe { filled(generator, Built::Board(built), error) },
        // SAFETY: as above.
        Err(wrong) => unsafe { refuse(error, status_of(&wrong), wrong) },
    }
}

/// Fills the memory of the caller.
///
/// # Safety
/// `generator` is null or points to a generator, `error` is null or points to an error; nobody else uses them.
unsafe fn filled(generator: *mut FootfallGenerator, built: Built, error: *mut FootfallError) -> FootfallStatus {
    if generator.is_null() || !generator.is_aligned() {
        // SAFETY: the caller guarantees the error.
        return unsafe {
            refuse(
                error,
                FootfallStatus::NotBuilt,
                "generator is null or not aligned; allowed is a variable of FootfallGenerator",
            )
        };
    }
    // SAFETY: it is not null, has the words that `fits` was asked about, and nobody else uses it.
    unsafe { slot::fill(generator.cast(), built) };
    FootfallStatus::Ok
}

/// The generator in memory of the caller; `None` if it was not built.
///
/// # Safety
/// `generator` is null or points to a generator of zeros or one that was built, which nobody else uses while the result lives.
unsafe fn built<'a>(generator: *mut FootfallGenerator) -> Option<&'a mut Built> {
    // SAFETY: the caller guarantees it.
    unsafe { slot::value(generator.cast()) }
}

/// Advances by one control period.
///
/// # Safety
/// `generator` is null or points to a generator of zeros or one that was built, and nobody else uses it during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_generator_step(generator: *mut FootfallGenerator) -> FootfallStatus {
    // SAFETY: the caller guarantees it.
    let Some(built) = (unsafe { built(generator) }) else { return FootfallStatus::NotBuilt };
    built.step();
    FootfallStatus::Ok
}

/// Returns to the state after the build.
///
/// # Safety
/// As `footfall_generator_step`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_generator_reset(generator: *mut FootfallGenerator) -> FootfallStatus {
    // SAFETY: the caller guarantees it.
    let Some(built) = (unsafe { built(generator) }) else { return FootfallStatus::NotBuilt };
    built.reset();
    FootfallStatus::Ok
}

/// The motion of a generator at one time.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct FootfallMotion {
    /// Joint angles, rad, flexion positive.
    pub angles_rad: [f32; 4],
    /// Angular velocities, rad/s.
    pub rates_rad_s: [f32; 4],
    /// Phase of the gait in units of 2^-32 cycles.
    pub phase: u32,
    /// Whether it is a follower whose phase and stride frequency are known.
    pub locked: bool,
    /// Estimated stride time of the person, s; 0 for a generator that follows nobody.
    pub stride_s: f32,
}

/// Reads the motion now.
///
/// # Safety
/// As `footfall_generator_step`; `motion` is null or points to a motion that nobody else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_generator_motion(
    generator: *mut FootfallGenerator,
    motion: *mut FootfallMotion,
) -> FootfallStatus {
    // SAFETY: the caller guarantees it.
    let Some(built) = (unsafe { built(generator) }) else { return FootfallStatus::NotBuilt };
    if motion.is_null() {
        return FootfallStatus::NotBuilt;
    }
    let status = if let Built::Board(generator) = built { generator.follow_status() } else { None };
    let locked = |status: &FollowStatus| status.state == cpg_core::entrainment::Lock::Locked;
    let found = FootfallMotion {
        angles_rad: built.angles(),
        rates_rad_s: built.rates(),
        phase: built.phase(),
        locked: status.as_ref().is_some_and(locked),
        stride_s: status.map_or(0.0, |status| status.stride_s),
    };
    // SAFETY: it is not null, and nobody else uses it.
    unsafe { motion.write(found) };
    FootfallStatus::Ok
}

/// Sets the measured angle of the followed joint for the next step, rad, flexion positive; NaN if the sample is not valid. Other
/// generators ignore it.
///
/// # Safety
/// As `footfall_generator_step`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_generator_observe(
    generator: *mut FootfallGenerator,
    angle_rad: f32,
) -> FootfallStatus {
    // SAFETY: the caller guarantees it.
    let Some(built) = (unsafe { built(generator) }) else { return FootfallStatus::NotBuilt };
    if let Built::Board(generator) = built {
        generator.observe(angle_rad.is_finite().then_some(Radians(angle_rad)));
    }
    FootfallStatus::Ok
}
