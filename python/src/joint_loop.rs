//! `JointLoop`: the control loop of a board, given samples from Python.

use footfall::board::default_loop::{Parameters, TYPICAL_MIN_SUPPLY, TYPICAL_VREFINT_CAL};
use footfall::options::sensors::SensorArgument;
use hgod_adc::Validity;
use joint_loop::Debugger;
use joint_loop::control::watchdog_clock::WatchdogHz;
use joint_loop::setup::default_loop::{BoardLoop, board_loop};
use joint_loop::tuning::Request;
use joint_loop::{BoardFaults, Cause, Frame, MAX_ELAPSED, SENSORS, Sample, SupervisorState};
use joint_units::{AdcCode, Joint, Period, Volts};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::arguments::Whole;
use crate::generator::Generator;
use crate::interrupt::Interrupts;
use crate::{arguments, arrays, error, tracking};

/// Whether a debugger is attached, in the order of the numbers of ``run``.
const DEBUGGERS: [(&str, Debugger); 3] =
    [("absent", Debugger::Absent), ("attached", Debugger::Attached), ("refused", Debugger::Refused)];

/// Least and highest supply of the boards' chips, V.
const SUPPLY_V: [f64; 2] = [1.8, 3.6];

/// Names of the faults that a board reports.
const FAULTS: [(&str, BoardFaults); 5] = [
    ("adc_overrun", BoardFaults::ADC_OVERRUN),
    ("break_input", BoardFaults::BREAK_INPUT),
    ("clock", BoardFaults::CLOCK),
    ("watchdog", BoardFaults::WATCHDOG),
    ("outputs", BoardFaults::OUTPUTS),
];

/// What the loop gave in successive calls, as columns.
#[derive(Default)]
pub(crate) struct Frames {
    tick: Vec<u32>,
    state: Vec<u8>,
    cause: Vec<u8>,
    measured: Vec<f32>,
    validity: Vec<u8>,
    setpoints: Vec<f32>,
    pulses: Vec<u16>,
    limited: Vec<u8>,
    hash: Vec<u64>,
}

impl Frames {
    fn push(&mut self, frame: &Frame<SENSORS>) {
        self.tick.push(frame.tick);
        self.state.push(frame.state as u8);
        self.cause.push(frame.cause as u8);
        self.measured.extend(frame.measured.map(|angle| angle.0));
        // 0 is a channel without a sensor.
        let place = |validity| Validity::ALL.iter().position(|known| *known == validity).map_or(0, |place| place + 1);
        self.validity.extend(frame.validity.map(|validity| validity.map_or(0, place) as u8));
        self.setpoints.extend(frame.setpoints.map(|angle| angle.0));
        self.pulses.extend(frame.pulses.map(|pulse| pulse.0));
        self.limited.push(frame.limited.bits());
        self.hash.push(frame.setpoint_hash);
    }

    fn into_ticks(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        let times: Vec<f64> = self.tick.iter().map(|tick| f64::from(*tick) * 1e-3).collect();
        let validities: Vec<&str> = std::iter::once("").chain(Validity::ALL.iter().map(|known| known.name())).collect();
        let fields = (
            arrays::column(py, self.tick),
            arrays::column(py, times),
            (arrays::column(py, self.state), SupervisorState::ALL.map(SupervisorState::name)),
            (arrays::column(py, self.cause), Cause::ALL.map(Cause::name).to_vec()),
            arrays::table(py, self.measured, SENSORS)?,
            (arrays::table(py, self.validity, SENSORS)?, validities),
            arrays::table(py, self.setpoints, Joint::COUNT)?,
            arrays::table(py, self.pulses, Joint::COUNT)?,
            arrays::column(py, self.limited),
            arrays::column(py, self.hash),
        );
        arrays::result(py, "_ticks", fields)
    }
}

/// The control loop of a board, bit for bit: samples in, setpoints (rad) and servo pulses (us) out, one tick a millisecond.
///
/// The clock of the watchdog has to be measured (``watchdog_hz=32000``). After the boot the emergency stop has to be tested
/// (``faults=['break_input']`` for some ticks, then none), then a hold of the button of 0.5 s
/// arms. ``generator``: the default walk if it is not given. ``sensors``: list of pairs of a joint and its sensor file, or ``None`` for the
/// published curve, in the order of the channels. ``robot``: a robot file. ``vrefint_cal``: factory code of the chip's reference.
/// ``min_supply_v``: V, 1.8 to 3.6. ``sensor_required``: move only while the sensors are good.
#[pyclass(module = "footfall")]
pub(crate) struct JointLoop {
    joints: BoardLoop,
    /// Channels that have a sensor.
    channels: usize,
}

impl JointLoop {
    pub(crate) fn new(joints: BoardLoop, channels: usize) -> Self {
        Self { joints, channels }
    }

    fn request(row: usize, text: &str) -> PyResult<Request> {
        text.parse().map_err(|error| error::input(format!("request of row {row} = '{text}': {error}")))
    }
}

fn code(name: &str, value: impl Into<i128>) -> PyResult<AdcCode> {
    Ok(AdcCode(arguments::whole(name, value, 0, AdcCode::MAX.0.into())? as u16))
}

/// The codes of the channels that have a sensor; the board's program reads no others.
fn codes<T: Into<i128> + Copy>(values: &[T]) -> PyResult<[AdcCode; SENSORS]> {
    let mut found = [AdcCode(0); SENSORS];
    for (place, value) in found.iter_mut().zip(values) {
        *place = code("codes", *value)?;
    }
    Ok(found)
}

/// A measurement of the clock of the watchdog.
fn hertz(value: Whole) -> PyResult<WatchdogHz> {
    Ok(WatchdogHz(arguments::whole("watchdog_hz", value, 0, u32::MAX.into())? as u32))
}

/// An argument of ``run``, whole numbers within a range; `row` and `column` of the wrong one are in the error.
fn numbers(name: &str, given: &arrays::Given, least: u16, most: u16) -> PyResult<Vec<u16>> {
    let is_allowed = |value: &f64| value.fract() == 0.0 && (f64::from(least)..=f64::from(most)).contains(value);
    if let Some(place) = given.values.iter().position(|value| !is_allowed(value)) {
        let (row, column, value) = (place / given.shape.1, place % given.shape.1, given.values[place]);
        let at = if given.shape.1 == 1 { format!("{row}") } else { format!("{row}, {column}") };
        return Err(error::input(format!("{name}[{at}] = {value}: allowed is a whole number from {least} to {most}")));
    }
    Ok(given.values.iter().map(|value| *value as u16).collect())
}

/// A column of ``run``: one whole number a row, `default` in each where it is not given.
fn column(
    name: &str,
    value: Option<&Bound<'_, PyAny>>,
    rows: usize,
    default: u16,
    (least, most): (u16, u16),
) -> PyResult<Vec<u16>> {
    let Some(value) = value else { return Ok(vec![default; rows]) };
    let given = arrays::given(name, value, None)?;
    let found = given.shape.0;
    if found != rows {
        return Err(error::input(format!(
            "{name} has the shape ({found},): allowed is ({rows},), a value for each row of codes"
        )));
    }
    numbers(name, &given, least, most)
}

/// A column of flags: booleans, 0 or 1; false where it is not given.
fn flags(name: &str, value: Option<&Bound<'_, PyAny>>, rows: usize) -> PyResult<Vec<bool>> {
    Ok(column(name, value, rows, 0, (0, 1))?.into_iter().map(|flag| flag == 1).collect())
}

/// A dictionary from rows to values, whose rows are some of those of ``codes``, with what `read` makes of each.
fn by_row<T, V>(
    name: &str,
    given: Option<BTreeMap<Whole, T>>,
    rows: usize,
    read: impl Fn(usize, T) -> PyResult<V>,
) -> PyResult<BTreeMap<usize, V>> {
    let row = |Whole(row): Whole| {
        let found = usize::try_from(row).ok().filter(|row| *row < rows);
        found.ok_or_else(|| {
            error::input(format!("{name} has row {row}: allowed are the rows of codes, from 0 to below {rows}"))
        })
    };
    let value_of = |(key, value)| row(key).and_then(|row| Ok((row, read(row, value)?)));
    given.unwrap_or_default().into_iter().map(value_of).collect()
}

fn faults(names: &[String]) -> PyResult<BoardFaults> {
    names.iter().try_fold(BoardFaults::NONE, |all, name| {
        let found = arguments::one_of("faults", name, FAULTS, |(name, _)| name)?;
        Ok(all.with(found.1))
    })
}

/// One frame as a `Tick` of the Python part.
fn frame<'py>(py: Python<'py>, frame: &Frame<SENSORS>) -> PyResult<Bound<'py, PyAny>> {
    let following = frame.following.as_ref().map(|status| tracking::status(py, status)).transpose()?;
    let counters = (frame.seq, frame.late, frame.missed, frame.overruns, frame.limited_ticks);
    let fields = (
        frame.tick,
        frame.state.name(),
        frame.cause.name(),
        arrays::column(py, frame.measured.map(|angle| angle.0).to_vec()),
        frame.validity.map(|validity| validity.map_or("", |validity| validity.name())).to_vec(),
        arrays::column(py, frame.setpoints.map(|angle| angle.0).to_vec()),
        arrays::column(py, frame.pulses.map(|pulse| pulse.0).to_vec()),
        frame.limited.bits(),
        frame.setpoint_hash,
        following,
        counters,
    );
    arrays::result(py, "Tick", fields)
}

#[pymethods]
impl JointLoop {
    #[new]
    #[pyo3(signature = (generator = None, *, sensors = None, robot = None, vrefint_cal = TYPICAL_VREFINT_CAL.0.into(),
        min_supply_v = None, sensor_required = true))]
    fn build(
        generator: Option<PyRef<'_, Generator>>,
        sensors: Option<Vec<(String, Option<PathBuf>)>>,
        robot: Option<PathBuf>,
        #[pyo3(from_py_with = arguments::integer)] vrefint_cal: i128,
        min_supply_v: Option<f64>,
        sensor_required: bool,
    ) -> PyResult<Self> {
        if let Some(period_s) =
            generator.as_ref().filter(|generator| generator.period != Period::MILLISECOND).map(|it| it.period_s())
        {
            return Err(error::input(format!(
                "generator has a control period of {period_s} s: allowed is 0.001 s, that of the boards; make it with period_s=0.001"
            )));
        }
        let vrefint_cal = arguments::whole("vrefint_cal", vrefint_cal, 1, AdcCode::MAX.0.into())? as u16;
        let [least, most] = SUPPLY_V;
        let min_supply_v =
            min_supply_v.map(|volts| arguments::within("min_supply_v", volts, least, most, " V")).transpose()?;
        let generator = generator.map(|generator| {
            generator.definition.config().ok_or_else(|| {
                error::input("a board cannot run this generator; allowed are generators of files, of fits and of Generator.default with four joints")
            })
        });
        let argument = |(joint, calibration): (String, Option<PathBuf>)| {
            calibration.as_deref().map_or(Ok(()), error::can_open)?;
            Ok(SensorArgument { joint: arguments::joint("sensors", &joint)?, calibration })
        };
        let sensors = sensors.map(|sensors| {
            let all = sensors.into_iter().map(argument).collect::<PyResult<Vec<_>>>()?;
            SensorArgument::read_all(&all).map_err(error::failure)
        });
        let robot = arguments::robot(robot.as_deref())?.robot;
        let parameters = Parameters::with_defaults(generator.transpose()?, sensors.transpose()?, robot);
        let parameters = parameters.map_err(error::input)?;
        let min_supply = robot.min_supply_on(min_supply_v.map_or(TYPICAL_MIN_SUPPLY, |volts| Volts(volts as f32)));
        let joints =
            board_loop(&parameters, AdcCode(vrefint_cal), min_supply, sensor_required).map_err(error::input)?;
        Ok(Self::new(joints, parameters.sensors.count()))
    }

    /// Takes the sample of one tick and returns its ``Tick``: setpoints (rad), pulses (us; 0 while the outputs are off), state, cause, hash.
    ///
    /// ``codes``: raw code of each channel that has a sensor, 0 to 4095. ``vrefint``: raw code of the chip's reference. ``button``, ``foot``: levels of the
    /// switches. ``late``: the tick began too late. ``faults``: names of faults that the board found: ``adc_overrun``, ``break_input``,
    /// ``clock``, ``watchdog``, ``outputs``. ``elapsed``: control periods (ms) since the last call, 1 to 255. ``watchdog_hz``: a new
    /// measurement of the
    /// clock of the watchdog, Hz, one of which must come before the arming. ``debugger``: ``absent``, ``attached`` or ``refused``.
    /// ``program_unproven``: the program in flash is not proven to be the one that was built. ``request``: of a host, such as ``1 set speed 1.2``.
    #[pyo3(signature = (codes, vrefint, *, button = false, foot = false, late = false, faults = vec![], elapsed = 1, watchdog_hz = None,
        debugger = "absent", program_unproven = false, request = None))]
    #[allow(clippy::too_many_arguments)] // They are keywords in Python.
    fn tick<'py>(
        &mut self,
        py: Python<'py>,
        codes: Vec<Whole>,
        vrefint: Whole,
        button: bool,
        foot: bool,
        late: bool,
        faults: Vec<String>,
        #[pyo3(from_py_with = arguments::integer)] elapsed: i128,
        watchdog_hz: Option<Whole>,
        debugger: &str,
        program_unproven: bool,
        request: Option<&str>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if codes.len() != self.channels {
            let (found, allowed) = (codes.len(), self.channels);
            return Err(error::input(format!("codes has {found} channels: allowed is {allowed}, one for each sensor")));
        }
        let sample = Sample {
            elapsed: arguments::whole("elapsed", elapsed, 1, MAX_ELAPSED.into())? as u32,
            codes: self::codes(&codes)?,
            vrefint: code("vrefint", vrefint)?,
            button,
            foot,
            late,
            faults: self::faults(&faults)?,
            watchdog_clock: watchdog_hz.map(hertz).transpose()?,
            debugger: arguments::one_of("debugger", debugger, DEBUGGERS, |(name, _)| name)?.1,
            program_unproven,
            request: request.map(|text| Self::request(0, text)).transpose()?,
        };
        self.joints.tick(&sample);
        frame(py, &self.joints.frame())
    }

    /// Takes one sample a row and returns ``Ticks``: columns of shape (n,) or (n, 4), setpoints in rad, pulses in us.
    ///
    /// An interrupt (Ctrl-C) ends it within about 50 ms: the loop then stands behind the last tick that it took, whose ``last`` it has.
    ///
    /// ``codes``: shape (n, channels), a column for each sensor. ``vrefint``: shape (n,). ``button``, ``foot``, ``late``: booleans, shape (n,). ``fault_bits``: shape (n,),
    /// bit 0 overrun, 1 break input, 2 clock, 3 watchdog, 4 outputs (0 to 31). ``elapsed``: control periods (ms) since the last call, shape (n,).
    /// ``watchdog_hz``: a
    /// dictionary from a row to a measurement of the clock of the watchdog, Hz, one of which must come before the arming. ``debugger``: 0 absent,
    /// 1 attached, 2 refused, shape (n,). ``program_unproven``: booleans, shape (n,). ``requests``: a dictionary from a row to the request of a host.
    #[pyo3(signature = (codes, vrefint, *, button = None, foot = None, late = None, fault_bits = None, elapsed = None, watchdog_hz = None,
        debugger = None, program_unproven = None, requests = None))]
    #[allow(clippy::too_many_arguments)] // They are keywords in Python.
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        codes: &Bound<'py, PyAny>,
        vrefint: &Bound<'py, PyAny>,
        button: Option<&Bound<'py, PyAny>>,
        foot: Option<&Bound<'py, PyAny>>,
        late: Option<&Bound<'py, PyAny>>,
        fault_bits: Option<&Bound<'py, PyAny>>,
        elapsed: Option<&Bound<'py, PyAny>>,
        watchdog_hz: Option<BTreeMap<Whole, Whole>>,
        debugger: Option<&Bound<'py, PyAny>>,
        program_unproven: Option<&Bound<'py, PyAny>>,
        requests: Option<BTreeMap<Whole, String>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let codes = arrays::given("codes", codes, Some(&self.channels.to_string()))?;
        let (rows, width) = codes.shape;
        if width != self.channels {
            return Err(error::input(format!(
                "codes has the shape ({rows}, {width}): allowed is (n, {}), a column for each sensor",
                self.channels
            )));
        }
        let codes = numbers("codes", &codes, 0, AdcCode::MAX.0)?;
        let vrefint = column("vrefint", Some(vrefint), rows, 0, (0, AdcCode::MAX.0))?;
        let (button, foot) = (flags("button", button, rows)?, flags("foot", foot, rows)?);
        let (late, program_unproven) = (flags("late", late, rows)?, flags("program_unproven", program_unproven, rows)?);
        let faults = column("fault_bits", fault_bits, rows, 0, (0, (1 << FAULTS.len()) - 1))?;
        let elapsed = column("elapsed", elapsed, rows, 1, (1, MAX_ELAPSED as u16))?;
        let debugger = column("debugger", debugger, rows, 0, (0, DEBUGGERS.len() as u16 - 1))?;
        let requests = by_row("requests", requests, rows, |row, text| Self::request(row, &text))?;
        let watchdog_hz = by_row("watchdog_hz", watchdog_hz, rows, |_, value| hertz(value))?;
        let joints = &mut self.joints;
        let frames = py.detach(|| {
            let (mut frames, mut interrupts) = (Frames::default(), Interrupts::new());
            for row in 0..rows {
                let mut channels = [AdcCode(0); SENSORS];
                for (channel, code) in channels.iter_mut().zip(&codes[row * width..]).take(width) {
                    *channel = AdcCode(*code);
                }
                joints.tick(&Sample {
                    elapsed: elapsed[row].into(),
                    codes: channels,
                    vrefint: AdcCode(vrefint[row]),
                    button: button[row],
                    foot: foot[row],
                    late: late[row],
                    faults: BoardFaults::from_bits(faults[row] as u8),
                    watchdog_clock: watchdog_hz.get(&row).copied(),
                    debugger: DEBUGGERS[debugger[row] as usize].1,
                    program_unproven: program_unproven[row],
                    request: requests.get(&row).copied(),
                });
                frames.push(&joints.frame());
                interrupts.check()?;
            }
            Ok::<_, PyErr>(frames)
        })?;
        frames.into_ticks(py)
    }

    /// The ``Tick`` of the last call: setpoints in rad, pulses in us.
    #[getter]
    fn last<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        frame(py, &self.joints.frame())
    }

    /// State of the supervisor: ``boot``, ``disarmed``, ``arming``, ``walking``, ``stopping``, ``fault``, ``trim_ready`` or ``trimming``; no unit.
    #[getter]
    fn state(&self) -> &'static str {
        self.joints.state().name()
    }

    /// Why the supervisor left a state or refused to arm, by name; no unit.
    #[getter]
    fn cause(&self) -> &'static str {
        self.joints.frame().cause.name()
    }

    /// Whether the emergency stop has to be pressed and released before the first arming; no unit.
    #[getter]
    fn awaits_stop_test(&self) -> bool {
        self.joints.awaits_stop_test()
    }

    /// Number of sensor channels that have a sensor, from channel 1 on; no unit.
    #[getter]
    fn channels(&self) -> usize {
        self.channels
    }

    /// Hash over every setpoint of every tick so far (64 bits), as the board computes it; no unit.
    #[getter]
    fn setpoint_hash(&self) -> u64 {
        self.joints.frame().setpoint_hash
    }

    fn __repr__(&self) -> String {
        let frame = self.joints.frame();
        format!("<footfall.JointLoop {}, tick {}, hash {:016x}>", frame.state.name(), frame.tick, frame.setpoint_hash)
    }
}
