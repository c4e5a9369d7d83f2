//! The control loop of the boards, given samples from C.

use hgod_adc::stm32f4::{MAX_SUPPLY, MIN_SUPPLY};
use joint_loop::Debugger;
use joint_loop::control::watchdog_clock::WatchdogHz;
use joint_loop::setup::default_loop::{BoardLoop, Parameters, board_loop};
use joint_loop::store::{generator_record, robot_record, sensor_record};
use joint_loop::{BoardFaults, RobotConfig, SENSORS, Sample};
use joint_units::{AdcCode, Joint, Volts};

use crate::error::{FootfallError, FootfallStatus, bytes, refuse};
use crate::slot;

/// Words of 8 bytes of a control loop.
pub const FOOTFALL_LOOP_WORDS: usize = 1152;

/// The control loop of a board at 1 kHz. Its memory belongs to the caller, who sets it to zeros at first; it may be copied as a whole.
#[repr(C, align(16))]
#[derive(Debug, Clone, Copy)]
pub struct FootfallLoop {
    /// No meaning for callers.
    pub words: [u64; FOOTFALL_LOOP_WORDS],
}

const _: () = assert!(slot::fits::<BoardLoop>(FOOTFALL_LOOP_WORDS));

impl slot::Kind for BoardLoop {
    const MARK: u64 = u64::from_le_bytes(*b"ff_loop\0");
}

/// A record, as `footfall pack` writes it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct FootfallRecord {
    /// Its bytes; null for the default.
    pub bytes: *const u8,
    /// Their number.
    pub length: usize,
}

/// Parts of a control loop.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct FootfallLoopConfig {
    /// Generator; the default walk if it is null.
    pub generator: FootfallRecord,
    /// Sensors; one with the published curve if it is null.
    pub sensors: FootfallRecord,
    /// Robot; the default robot if it is null.
    pub robot: FootfallRecord,
    /// Factory code of the chip's reference.
    pub vrefint_cal: u16,
    /// Lowest supply at which a sample is good, V, 1.8 to 3.6; that of the robot where it is higher.
    pub min_supply_v: f32,
    /// Whether the joints move only while the sensors are good.
    pub sensor_required: bool,
}

/// Inputs of one tick.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct FootfallSample {
    /// Raw code of each sensor channel, 0 to 4095.
    pub codes: [u16; 4],
    /// Raw code of the chip's reference.
    pub vrefint: u16,
    /// Control periods since the last call: 1, or more where periods were missed.
    pub elapsed: u8,
    /// Faults that the board found: bit 0 overrun, 1 break input, 2 clock, 3 watchdog, 4 outputs.
    pub fault_bits: u8,
    /// A new measurement of the clock of the board's watchdog, Hz; read where `watchdog_measured` is set. One must come before the first arming.
    pub watchdog_hz: u32,
    /// Whether `watchdog_hz` is a new measurement.
    pub watchdog_measured: bool,
    /// Debugger: 0 absent, 1 attached, 2 or more: attached and refused.
    pub debugger: u8,
    /// The button is pressed.
    pub button: bool,
    /// The foot is on the floor.
    pub foot: bool,
    /// The tick began too late.
    pub late: bool,
    /// The program in flash is not proven to be the one that was built: the board does not arm.
    pub program_unproven: bool,
}

/// Outputs of one tick.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct FootfallFrame {
    /// Control periods since the boot.
    pub tick: u32,
    /// State of the supervisor: 0 boot, 1 disarmed, 2 arming, 3 walking, 4 stopping, 5 fault, 6 trim_ready, 7 trimming.
    pub state: u8,
    /// Why the last motion ended or was refused, as a number; docs/safety.md has the names.
    pub cause: u8,
    /// Setpoints, rad.
    pub setpoints_rad: [f32; 4],
    /// Servo pulses, us; 0 while the outputs are off.
    pub pulses_us: [u16; 4],
    /// Hash over every setpoint so far, as the board computes it.
    pub setpoint_hash: u64,
}

/// A record of the caller, or none where it is null; an error says what is wrong with it.
///
/// # Safety
/// `record.bytes` is null or points to `record.length` bytes that stay while the result lives.
unsafe fn stored<T, E: core::fmt::Display>(
    record: FootfallRecord,
    read: impl Fn(&[u8]) -> Result<Option<T>, E>,
) -> Result<Option<T>, E> {
    // SAFETY: the caller guarantees the bytes.
    unsafe { bytes(record.bytes, record.length) }.map_or(Ok(None), read)
}

/// Builds a control loop at 1 kHz, before its first tick. `error` may be null.
///
/// # Safety
/// `joints` is null or points to a loop, `config` is null or points to a configuration whose records are null or have their bytes, `error` is null or
/// points to an error; nobody else uses them during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_loop_build(
    joints: *mut FootfallLoop,
    config: *const FootfallLoopConfig,
    error: *mut FootfallError,
) -> FootfallStatus {
    // SAFETY: the caller guarantees it.
    let Some(config) = (unsafe { config.as_ref() }).filter(|_| !joints.is_null() && joints.is_aligned()) else {
        // SAFETY: as above.
        return unsafe {
            refuse(
                error,
                FootfallStatus::NotBuilt,
                "joints or config is null, or joints is not aligned; allowed are variables of their types",
            )
        };
    };
    // SAFETY: as above, of each record.
    let generator = match unsafe { stored(config.generator, generator_record::read) } {
        Ok(stored) => stored.map(|stored| stored.config),
        // SAFETY: as above.
        Err(wrong) => return unsafe { refuse(error, FootfallStatus::Record, wrong) },
    };
    // SAFETY: as above.
    let sensors = match unsafe { stored(config.sensors, sensor_record::read) } {
        Ok(stored) => stored.map(|stored| stored.sensors),
        // SAFETY: as above.
        Err(wrong) => return unsafe { refuse(error, FootfallStatus::Record, wrong) },
    };
    // SAFETY: as above.
    let robot = match unsafe { stored(config.robot, robot_record::read) } {
        Ok(stored) => stored.map_or(RobotConfig::default_biped(), |stored| stored.robot),
        // SAFETY: as above.
        Err(wrong) => return unsafe { refuse(error, FootfallStatus::Record, wrong) },
    };
    // The larger one of two would hide a value that is too small.
    let allowed = MIN_SUPPLY.0..=MAX_SUPPLY.0;
    if !allowed.contains(&config.min_supply_v) {
        let (least, most) = (MIN_SUPPLY.0, MAX_SUPPLY.0);
        let wrong = format_args!("min_supply_v is {} V; allowed are {least} to {most} V", config.min_supply_v);
        // SAFETY: as above.
        return unsafe { refuse(error, FootfallStatus::Loop, wrong) };
    }
    let (reference, supply) = (AdcCode(config.vrefint_cal), robot.min_supply_on(Volts(config.min_supply_v)));
    let built = Parameters::with_defaults(generator, sensors, robot)
        .and_then(|parameters| board_loop(&parameters, reference, supply, config.sensor_required));
    match built {
        Ok(built) => {
            // SAFETY: it is not null, has the words that `fits` was asked about, and nobody else uses it.
            unsafe { slot::fill(joints.cast(), built) };
            FootfallStatus::Ok
        }
        // SAFETY: as above.
        Err(wrong) => unsafe { refuse(error, FootfallStatus::Loop, wrong) },
    }
}

/// Takes the sample of one tick and writes what the loop gives.
///
/// # Safety
/// `joints` is null or points to a loop of zeros or one that was built, `sample` and `frame` are null or point to theirs; nobody else uses them
/// during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_loop_tick(
    joints: *mut FootfallLoop,
    sample: *const FootfallSample,
    frame: *mut FootfallFrame,
) -> FootfallStatus {
    // SAFETY: the caller guarantees all three.
    let (joints, sample) = unsafe { (slot::value::<BoardLoop>(joints.cast()), sample.as_ref()) };
    let (Some(joints), Some(sample)) = (joints, sample) else { return FootfallStatus::NotBuilt };
    if frame.is_null() {
        return FootfallStatus::NotBuilt;
    }
    joints.tick(&Sample::<SENSORS> {
        elapsed: sample.elapsed.into(),
        codes: sample.codes.map(AdcCode),
        vrefint: AdcCode(sample.vrefint),
        button: sample.button,
        foot: sample.foot,
        late: sample.late,
        faults: BoardFaults::from_bits(sample.fault_bits),
        watchdog_clock: sample.watchdog_measured.then_some(WatchdogHz(sample.watchdog_hz)),
        debugger: match sample.debugger {
            0 => Debugger::Absent,
            1 => Debugger::Attached,
            _ => Debugger::Refused,
        },
        program_unproven: sample.program_unproven,
        request: None,
    });
    let given = joints.frame();
    let found = FootfallFrame {
        tick: given.tick,
        state: given.state as u8,
        cause: given.cause as u8,
        setpoints_rad: given.setpoints.map(|angle| angle.0),
        pulses_us: given.pulses.map(|pulse| pulse.0),
        setpoint_hash: given.setpoint_hash,
    };
    // SAFETY: it is not null, and nobody else uses it.
    unsafe { frame.write(found) };
    FootfallStatus::Ok
}

const _: () = assert!(SENSORS == 4 && Joint::COUNT == 4, "the arrays of the header have four entries");
