//! The lines of the board's log that carry numbers, as text, exactly as `defmt` prints them.
//!
//! ```text
//! boot BOARD CHIP reset CAUSE streak N vrefint_cal CODE min_supply VOLTS sensor required|ignored walker CRC sensors CRC
//!      outputs servos|shadow                                                                     (one line)
//! state N STATE cause CAUSE
//! tick N STATE {sensor DEG deg VERDICT} x WORN set DEG DEG DEG DEG deg pulse US US US US us late N missed N limited BITS seq N
//!      hash HEX                                                                                  (one line)
//! inputs FIRST COUNT {CODE x WORN VREFINT ELAPSED FLAGS} x COUNT
//! follow N LOCK fault FAULT stride S s off DEG deg confidence C
//! edge N US us LEVEL
//! cost CYCLES cycles dropped N
//! margin start US us stack BYTES of BYTES bytes
//! env CELSIUS C supply VOLTS V
//! ```
//! WORN is how many sensors are worn, 1 to [`SENSORS`]. `tick` is a [`joint_loop::Frame`], ten calls of the loop apart; `inputs` is what
//! every call was given. Numbers of type `f32` are printed with as many digits as it takes to tell them from their neighbours, so that
//! their bits come back. `env` is the mean of a second, `NaN` where the chip has no factory values to tell by. A pulse of 0 is no pulse.

mod words;

use cpg_core::entrainment::{Lock, SensorFault};
use hgod_adc::Validity;
use joint_loop::{BoardFaults, Cause, SENSORS, Sample, SupervisorState};
use joint_units::{AdcCode, Celsius, Joint, Volts};
use words::Words;

/// A line of the log, understood as far as it can be.
#[derive(Debug, Clone, PartialEq)]
pub enum Line {
    /// The first line after a reset.
    Boot(Boot),
    /// The supervisor changed its state.
    State(Change),
    /// What the loop saw and did.
    Tick(Tick),
    /// What the loop was given.
    Inputs(Inputs),
    /// How a walker that follows stands.
    Follow(Follow),
    /// An edge at the synchronisation input.
    Edge(Edge),
    /// What it cost.
    Cost(Cost),
    /// What it left to spare.
    Margin(Margin),
    /// How warm and how well supplied it is.
    Env(Env),
    /// For people.
    Text,
}

/// `boot ...`
#[derive(Debug, Clone, PartialEq)]
pub struct Boot {
    /// Name of the board.
    pub board: String,
    /// Name of the chip.
    pub chip: String,
    /// Why it was reset.
    pub reset: String,
    /// Crashes in a row before this boot.
    pub streak: u32,
    /// The factory's reading of the internal reference.
    pub vrefint_cal: AdcCode,
    /// Supply below which no sample is good.
    pub min_supply: Volts,
    /// Whether it walks only while the gait sensor is good.
    pub sensor_required: bool,
    /// The check sum that names the walker's parameters, see [`joint_loop::store::generator_record`].
    pub generator_crc: u32,
    /// The check sum that names the worn sensors, see [`joint_loop::store::sensor_record`].
    pub sensors_crc: u32,
    /// Nothing is driven.
    pub shadow: bool,
}

/// `state ...`
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The tick of the frame that shows it.
    pub tick: u32,
    /// The new state.
    pub state: SupervisorState,
    /// Why.
    pub cause: Cause,
}

/// `tick ...`
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// Control periods since the boot, missed ones included.
    pub tick: u32,
    /// SupervisorState of the supervisor.
    pub state: SupervisorState,
    /// Measured angles, in degrees; 0 where no sensor is worn.
    pub sensor_deg: [f32; SENSORS],
    /// Verdicts on the sensors' samples; `None` where none is worn.
    pub verdict: [Option<Validity>; SENSORS],
    /// The four setpoints, in degrees.
    pub set_deg: [f32; Joint::COUNT],
    /// The four commanded pulse widths in microseconds; 0 is no pulse.
    pub pulse_us: [u16; Joint::COUNT],
    /// Late ticks so far.
    pub late: u32,
    /// Missed ticks so far.
    pub missed: u32,
    /// What held the setpoints back, see [`joint_loop::GateStatus`].
    pub limited: u8,
    /// Calls of the loop so far.
    pub seq: u32,
    /// Hash of all setpoints so far.
    pub hash: u64,
}

/// `inputs ...`
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Inputs {
    /// The tick of the first call.
    pub first_tick: u32,
    /// Sensors that are worn: the first ones of each call.
    pub sensors: usize,
    /// What each call was given, in order.
    pub calls: Vec<Call>,
}

/// What one call of the loop was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Call {
    /// Codes of the sensors; 0 where none is worn.
    pub sensors: [AdcCode; SENSORS],
    /// Code of the internal reference.
    pub vrefint: AdcCode,
    /// Control periods since the call before.
    pub elapsed: u8,
    /// Bit 0 button, bit 1 late, bits 2 to 7 faults of the board, bit 8 foot on the floor.
    pub flags: u16,
}

impl Call {
    /// As the loop takes it.
    #[must_use]
    pub const fn sample(self) -> Sample<SENSORS> {
        Sample {
            elapsed: self.elapsed as u32,
            codes: self.sensors,
            vrefint: self.vrefint,
            button: self.flags & 1 != 0,
            late: self.flags & 2 != 0,
            foot: self.flags & 0x100 != 0,
            faults: BoardFaults::from_bits((self.flags >> 2) as u8),
        }
    }
}

/// `follow ...`: how a walker that follows the gait sensor stands, after the `tick` line of the same tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follow {
    /// Control periods since the boot.
    pub tick: u32,
    /// The state.
    pub state: Lock,
    /// What is wrong with the sensor, if something is.
    pub fault: Option<SensorFault>,
    /// The person's stride time as estimated, s.
    pub stride_s: f32,
    /// Phase of the person less the estimated one, degrees of the cycle.
    pub phase_error_deg: f32,
    /// 1 where the sensor says what was foretold, 0 where nothing can be told.
    pub confidence: f32,
}

/// `edge ...`: an edge at the synchronisation input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// The tick that took it.
    pub tick: u32,
    /// When it was after that tick's beginning, us; before it, as a rule.
    pub offset_us: i32,
    /// The level after it.
    pub high: bool,
}

impl Edge {
    /// Seconds since the boot, by the board's clock.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        f64::from(self.tick) * 1e-3 + f64::from(self.offset_us) * 1e-6
    }
}

/// `cost ...`
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    /// Longest tick of the last second, in cycles of the core.
    pub longest_cycles: u32,
    /// Records that the log had no room for, since the boot.
    pub dropped: u32,
}

/// `margin ...`
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Margin {
    /// Latest start of a tick after its trigger in the last second, in microseconds.
    pub latest_start_us: u32,
    /// Most of the stack that was ever in use, in bytes.
    pub stack_used: u32,
    /// The stack, in bytes.
    pub stack_size: u32,
}

/// `env ...`
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Env {
    /// Temperature of the die; `None`: the board cannot tell.
    pub die: Option<Celsius>,
    /// Supply of the converter; `None`: the board cannot tell.
    pub supply: Option<Volts>,
}

/// A line that begins as one of these but goes on otherwise: board and host are of different versions.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{line}`: {wanted} expected at `{found}`")]
pub struct LineError {
    /// The line.
    pub line: String,
    /// What should have come.
    pub wanted: String,
    /// What came; empty at the end of the line.
    pub found: String,
}

/// Reads a line.
///
/// # Errors
/// It begins with one of the words above and goes on in another way.
///
/// ```
/// use footfall::board::telemetry::{Line, parse};
/// let line = "tick 20 walking sensor 12.25 deg good set 1.5 -2 30 4 deg pulse 1500 1520 1056 1944 us \
///             late 0 missed 0 limited 0 seq 20 hash 00000000deadbeef";
/// let Line::Tick(tick) = parse(line)? else { panic!() };
/// assert_eq!((tick.tick, tick.set_deg[1], tick.hash), (20, -2.0, 0xdead_beef));
/// assert_eq!(parse("ready")?, Line::Text);
/// assert_eq!(parse("tick 20 walking sensor").unwrap_err().wanted, "a number");
/// # Ok::<(), footfall::board::telemetry::LineError>(())
/// ```
pub fn parse(line: &str) -> Result<Line, LineError> {
    let mut words = Words::of(line);
    let parsed = match words.next() {
        "boot" => match boot(&mut words)? {
            Some(boot) => Line::Boot(boot),
            None => return Ok(Line::Text),
        },
        "state" => Line::State(change(&mut words)?),
        "tick" => Line::Tick(tick(&mut words)?),
        "inputs" => Line::Inputs(inputs(&mut words)?),
        "follow" => Line::Follow(follow(&mut words)?),
        "edge" => Line::Edge(edge(&mut words)?),
        "cost" => Line::Cost(cost(&mut words)?),
        "margin" => Line::Margin(margin(&mut words)?),
        "env" => Line::Env(env(&mut words)?),
        _ => return Ok(Line::Text),
    };
    words.end()?;
    Ok(parsed)
}

/// `None` for a board that only says why it does not start: `boot BOARD CHIP reset CAUSE: ...`.
fn boot(words: &mut Words<'_>) -> Result<Option<Boot>, LineError> {
    let (board, chip) = (words.text()?, words.text()?);
    let reset = words.after("reset")?.text()?;
    if reset.ends_with(':') {
        return Ok(None);
    }
    let streak = words.after("streak")?.number()?;
    let vrefint_cal = AdcCode(words.after("vrefint_cal")?.number()?);
    let min_supply = Volts(words.after("min_supply")?.number()?);
    let sensor_required = words.after("sensor")?.name("`required` or `ignored`", |word| match word {
        "required" => Some(true),
        "ignored" => Some(false),
        _ => None,
    })?;
    let generator_crc = words.after("walker")?.hexadecimal(8, |word| u32::from_str_radix(word, 16).ok())?;
    let sensors_crc = words.after("sensors")?.hexadecimal(8, |word| u32::from_str_radix(word, 16).ok())?;
    let shadow = words.after("outputs")?.name("`servos` or `shadow`", |word| match word {
        "servos" => Some(false),
        "shadow" => Some(true),
        _ => None,
    })?;
    Ok(Some(Boot {
        board,
        chip,
        reset,
        streak,
        vrefint_cal,
        min_supply,
        sensor_required,
        generator_crc,
        sensors_crc,
        shadow,
    }))
}

fn change(words: &mut Words<'_>) -> Result<Change, LineError> {
    let tick = words.number()?;
    let state = words.name("a state", SupervisorState::from_name)?;
    Ok(Change { tick, state, cause: words.after("cause")?.name("a cause", Cause::from_name)? })
}

fn tick(words: &mut Words<'_>) -> Result<Tick, LineError> {
    let (tick, state) = (words.number()?, words.name("a state", SupervisorState::from_name)?);
    let (mut sensor_deg, mut verdict) = ([0.0; SENSORS], [None; SENSORS]);
    for (n, (deg, verdict)) in sensor_deg.iter_mut().zip(&mut verdict).enumerate() {
        // One at least.
        if n > 0 && words.peek() != "sensor" {
            break;
        }
        *deg = words.after("sensor")?.number()?;
        *verdict = Some(words.after("deg")?.name("a verdict", Validity::from_name)?);
    }
    Ok(Tick {
        tick,
        state,
        sensor_deg,
        verdict,
        set_deg: words.after("set")?.four()?,
        pulse_us: words.after("deg")?.after("pulse")?.four()?,
        late: words.after("us")?.after("late")?.number()?,
        missed: words.after("missed")?.number()?,
        limited: words.after("limited")?.number()?,
        seq: words.after("seq")?.number()?,
        hash: words.after("hash")?.hexadecimal(16, |word| u64::from_str_radix(word, 16).ok())?,
    })
}

fn inputs(words: &mut Words<'_>) -> Result<Inputs, LineError> {
    let (first_tick, count): (u32, u8) = (words.number()?, words.number()?);
    // Of each call: the codes, VREFINT, elapsed, flags.
    let groups = words.left().checked_div(count.into()).unwrap_or(0);
    let sensors_count = groups.saturating_sub(3).clamp(1, SENSORS);
    let mut calls = Vec::with_capacity(count.into());
    for _ in 0..count {
        let mut sensors = [AdcCode(0); SENSORS];
        for sensor in sensors.iter_mut().take(sensors_count) {
            *sensor = AdcCode(words.number()?);
        }
        let vrefint = AdcCode(words.number()?);
        calls.push(Call { sensors, vrefint, elapsed: words.number()?, flags: words.number()? });
    }
    Ok(Inputs { first_tick, sensors: sensors_count, calls })
}

fn follow(words: &mut Words<'_>) -> Result<Follow, LineError> {
    let tick = words.number()?;
    let state = words.name("a state of the lock", |word| Lock::ALL.into_iter().find(|lock| lock.name() == word))?;
    let fault = words.after("fault")?.name("a fault of the sensor, or `none`", |word| {
        let found = SensorFault::ALL.into_iter().find(|fault| fault.name() == word);
        if word == "none" { Some(None) } else { found.map(Some) }
    })?;
    let stride_s = words.after("stride")?.number()?;
    let phase_error_deg = words.after("s")?.after("off")?.number()?;
    let confidence = words.after("deg")?.after("confidence")?.number()?;
    Ok(Follow { tick, state, fault, stride_s, phase_error_deg, confidence })
}

fn edge(words: &mut Words<'_>) -> Result<Edge, LineError> {
    let (tick, offset_us) = (words.number()?, words.number()?);
    let high = words.after("us")?.name("0 or 1", |word| match word {
        "0" => Some(false),
        "1" => Some(true),
        _ => None,
    })?;
    Ok(Edge { tick, offset_us, high })
}

fn cost(words: &mut Words<'_>) -> Result<Cost, LineError> {
    let longest_cycles = words.number()?;
    Ok(Cost { longest_cycles, dropped: words.after("cycles")?.after("dropped")?.number()? })
}

fn margin(words: &mut Words<'_>) -> Result<Margin, LineError> {
    let latest_start_us = words.after("start")?.number()?;
    let stack_used = words.after("us")?.after("stack")?.number()?;
    let stack_size = words.after("of")?.number()?;
    words.after("bytes")?;
    Ok(Margin { latest_start_us, stack_used, stack_size })
}

fn env(words: &mut Words<'_>) -> Result<Env, LineError> {
    let told = |number: f32| number.is_finite().then_some(number);
    let die = told(words.number()?).map(Celsius);
    let supply = told(words.after("C")?.after("supply")?.number()?).map(Volts);
    words.after("V")?;
    Ok(Env { die, supply })
}

impl std::fmt::Display for Tick {
    /// As the board prints it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [s0, s1, s2, s3] = self.set_deg;
        let [p0, p1, p2, p3] = self.pulse_us;
        write!(f, "tick {} {}", self.tick, self.state.name())?;
        for (deg, verdict) in self.sensor_deg.iter().zip(&self.verdict) {
            if let Some(verdict) = verdict {
                write!(f, " sensor {deg} deg {verdict}")?;
            }
        }
        write!(f, " set {s0} {s1} {s2} {s3} deg pulse {p0} {p1} {p2} {p3} us late {}", self.late)?;
        write!(f, " missed {} limited {} seq {} hash {:016x}", self.missed, self.limited, self.seq, self.hash)
    }
}

impl std::fmt::Display for Follow {
    /// As the board prints it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { tick, state, fault, stride_s, phase_error_deg, confidence } = self;
        let fault = fault.map_or("none", SensorFault::name);
        let state = state.name();
        write!(
            f,
            "follow {tick} {state} fault {fault} stride {stride_s} s off {phase_error_deg} deg confidence {confidence}"
        )
    }
}

impl std::fmt::Display for Edge {
    /// As the board prints it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "edge {} {} us {}", self.tick, self.offset_us, u8::from(self.high))
    }
}

impl std::fmt::Display for Inputs {
    /// As the board prints it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "inputs {} {}", self.first_tick, self.calls.len())?;
        for call in &self.calls {
            for sensor in call.sensors.iter().take(self.sensors) {
                write!(f, " {}", sensor.0)?;
            }
            write!(f, " {} {} {}", call.vrefint.0, call.elapsed, call.flags)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn each_line_is_read() {
        let boot = "boot f4-discovery STM32F407VGTx reset power_on streak 0 vrefint_cal 1502 min_supply 2.7 sensor required walker 00c0ffee \
             sensors 0000beef outputs shadow";
        let boot = parse(boot);
        let Ok(Line::Boot(boot)) = boot else { panic!("{boot:?}") };
        assert_eq!((boot.vrefint_cal, boot.streak, boot.min_supply), (AdcCode(1502), 0, Volts(2.7)));
        assert_eq!((boot.sensor_required, boot.generator_crc), (true, 0x00c0_ffee));
        assert_eq!((boot.sensors_crc, boot.shadow), (0xbeef, true));
        let dark = parse("boot f4-discovery STM32F407VGTx reset power_on: no 8 MHz from HSE; staying dark");
        assert_eq!(dark, Ok(Line::Text));
        let change = Change { tick: 1230, state: SupervisorState::Stopping, cause: Cause::Button };
        assert_eq!(parse("state 1230 stopping cause button"), Ok(Line::State(change)));
        assert_eq!(parse("cost 9100 cycles dropped 2"), Ok(Line::Cost(Cost { longest_cycles: 9100, dropped: 2 })));
        let margin = Margin { latest_start_us: 38, stack_used: 900, stack_size: 9000 };
        assert_eq!(parse("margin start 38 us stack 900 of 9000 bytes"), Ok(Line::Margin(margin)));
        let env = Env { die: Some(Celsius(31.25)), supply: Some(Volts(2.998)) };
        assert_eq!(parse("env 31.25 C supply 2.998 V"), Ok(Line::Env(env)));
        assert_eq!(parse("env NaN C supply NaN V"), Ok(Line::Env(Env { die: None, supply: None })));
        // However many sensors are worn.
        for worn in 1..=SENSORS {
            let codes = |code: &str| vec![code; worn].join(" ");
            let line = format!("inputs 7 2 {} 1502 1 1 {} 1503 3 290", codes("2048"), codes("2049"));
            let Line::Inputs(inputs) = parse(&line).unwrap() else { panic!() };
            assert_eq!((inputs.first_tick, inputs.sensors, inputs.to_string()), (7, worn, line));
            let sample = inputs.calls[1].sample();
            assert_eq!((sample.elapsed, sample.codes[worn - 1].0, sample.vrefint.0), (3, 2049, 1503));
            assert!(!sample.button && sample.late && sample.foot && sample.faults.bits() == 8);
            assert!(inputs.calls[0].sample().button && !inputs.calls[0].sample().foot);
        }
        let follow = "follow 120 holding fault stuck stride 1.125 s off -3.5 deg confidence 0.75";
        let Line::Follow(found) = parse(follow).unwrap() else { panic!() };
        assert_eq!((found.to_string().as_str(), found.fault), (follow, Some(SensorFault::Stuck)));
        let Line::Follow(sound) = parse(&follow.replace("stuck", "none")).unwrap() else { panic!() };
        assert_eq!((sound.state, sound.fault), (Lock::Holding, None));
        let Line::Edge(edge) = parse("edge 1200 -250 us 1").unwrap() else { panic!() };
        assert!((edge.time_s() - 1.19975).abs() < 1e-9);
        assert_eq!((edge.high, edge.to_string().as_str()), (true, "edge 1200 -250 us 1"));
        assert_eq!(parse("edges lost 1200"), Ok(Line::Text));
    }

    #[test]
    fn lines_of_another_version_are_refused_where_they_differ() {
        for (line, wanted, found) in [
            ("boot f4-discovery", "a word", ""),
            ("boot a b reset power_on streak x", "a number", "x"),
            (
                "boot a b reset pin streak 0 vrefint_cal 1502 min_supply 2.7 sensor maybe",
                "`required` or `ignored`",
                "maybe",
            ),
            ("tick 1 running sensor 0 deg good", "a state", "running"),
            ("tick 1 walking sensor 0 deg fine", "a verdict", "fine"),
            ("tick 1 walking sensor 0 rad good", "`deg`", "rad"),
            ("inputs 1 2 5 5 1 0", "a number", ""),
            ("inputs 1 1 5 5 256 0", "a number", "256"),
            ("cost 1 cycles dropped 2 3", "the end of the line", "3"),
            ("margin 1", "`start`", "1"),
            ("env 31 F", "`C`", "F"),
            ("state 5 walking because", "`cause`", "because"),
            ("follow 5 lost", "a state of the lock", "lost"),
            ("follow 5 locked fault bad", "a fault of the sensor, or `none`", "bad"),
            ("edge 5 6 us up", "0 or 1", "up"),
        ] {
            let error = parse(line).unwrap_err();
            assert_eq!((error.wanted.as_str(), error.found.as_str()), (wanted, found), "{line}");
        }
    }

    fn any_tick() -> impl Strategy<Value = Tick> {
        let number = || any::<f32>().prop_filter("finite", |x| x.is_finite());
        let sensors = prop::collection::vec((number(), 0..Validity::ALL.len()), 1..=SENSORS);
        let head = (any::<u32>(), 0..SupervisorState::ALL.len(), sensors);
        let body = (prop::array::uniform4(number()), prop::array::uniform4(any::<u16>()));
        let tail = (any::<u32>(), any::<u32>(), any::<u8>(), any::<u32>(), any::<u64>());
        (head, body, tail).prop_map(|((tick, state, sensors), (set_deg, pulse_us), tail)| {
            let (late, missed, limited, seq, hash) = tail;
            let state = SupervisorState::ALL[state];
            let sensor_deg = std::array::from_fn(|n| sensors.get(n).map_or(0.0, |sensor| sensor.0));
            let verdict = std::array::from_fn(|n| sensors.get(n).map(|sensor| Validity::ALL[sensor.1]));
            Tick { tick, state, sensor_deg, verdict, set_deg, pulse_us, late, missed, limited, seq, hash }
        })
    }

    proptest! {
        #[test]
        fn a_printed_tick_is_read_back_bit_for_bit(tick in any_tick()) {
            let Line::Tick(back) = parse(&tick.to_string()).unwrap() else { panic!() };
            prop_assert_eq!(back.set_deg.map(f32::to_bits), tick.set_deg.map(f32::to_bits));
            prop_assert_eq!(back.sensor_deg.map(f32::to_bits), tick.sensor_deg.map(f32::to_bits));
            prop_assert_eq!(back, tick);
        }

        #[test]
        fn no_line_panics(line in "(boot|tick|inputs|follow|edge|cost|state|margin|[0-9]{1,12}|walking|good|deg|set|-1.5|[a-z]{1,6}| ){0,40}") {
            let _ = parse(&line);
        }
    }
}
