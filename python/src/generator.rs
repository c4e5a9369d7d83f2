//! `Generator`: a generator of a file, a default or a gait by name, stepped from Python.

use cpg_core::Follow;
use cpg_core::gait::named::Gait;
use generator_file::file::GeneratorFile;
use generator_file::network_file::{HostGenerator, JOINTS, NetworkFile};
use joint_loop::GeneratorConfig;
use joint_units::{Joint, Period, Radians};
use pyo3::prelude::*;
use pyo3::types::PyType;
use std::path::PathBuf;

use crate::arguments::Whole;
use crate::interrupt::Interrupts;
use crate::stepped::{self, Stepped};
use crate::tracking::{Statuses, cycles, names, status};
use crate::{arguments, arrays, error};

/// Most rows of one `run`: 2.7 hours at 1 kHz.
const MOST_STEPS: f64 = 1e7;

/// What a generator is built from.
#[derive(Debug, Clone)]
// There are few of them.
#[allow(clippy::large_enum_variant)]
pub(crate) enum Definition {
    /// A generator file.
    File(HostGenerator),
    /// A gait at a speed.
    Gait(Gait, f32),
}

impl Definition {
    /// The configuration that a board can run; `None` if there is none.
    pub(crate) fn config(&self) -> Option<GeneratorConfig> {
        match self {
            Self::File(HostGenerator::FourJoints(file)) => Some(file.set.config()),
            _ => None,
        }
    }

    fn build(&self, period: Period) -> PyResult<Box<dyn Stepped>> {
        Ok(match self {
            Self::File(HostGenerator::FourJoints(file)) => Box::new(file.set.build(period).map_err(error::input)?),
            Self::File(HostGenerator::Network(file)) => stepped::network(&file.set, period).map_err(error::input)?,
            Self::Gait(gait, speed) => Box::new(gait.build(*speed, period).map_err(error::input)?),
        })
    }
}

/// A central pattern generator: one step a control period, joint angles out.
///
/// Made by ``Generator.default``, ``Generator.gait``, ``Generator.read`` or ``Generator.parse``. Angles are radians, flexion positive, in the
/// order of ``joints``; they have the shape ``(4,)`` for hips and knees, ``(6,)`` or ``(8,)`` for networks with ankles and arms.
/// The same numbers come from the board: the arithmetic is that of the firmware, in single precision. Networks of six and eight joints
/// run on the host only, in double precision.
///
/// A pickled generator is restored with the same state, by as many steps from its start. A follower that has been given measurements
/// cannot be pickled before ``reset()``.
#[pyclass(module = "footfall")]
pub(crate) struct Generator {
    pub(crate) definition: Definition,
    built: Box<dyn Stepped>,
    pub(crate) period: Period,
    /// Steps since the start.
    steps: u64,
    /// It was given measurements since its start.
    observed: bool,
}

impl Generator {
    pub(crate) fn new(definition: Definition, period: Period) -> PyResult<Self> {
        Ok(Self { built: definition.build(period)?, definition, period, steps: 0, observed: false })
    }

    pub(crate) fn of_file(file: GeneratorFile, period: Period) -> PyResult<Self> {
        Self::new(Definition::File(HostGenerator::FourJoints(file)), period)
    }

    fn four(&self, values: impl Fn(&dyn Stepped, &mut Vec<f32>)) -> Vec<f32> {
        let mut out = Vec::with_capacity(self.built.joints());
        values(self.built.as_ref(), &mut out);
        out
    }

    fn seconds(&self, steps: u64) -> f64 {
        steps as f64 * f64::from(self.period.micros()) * 1e-6
    }

    /// Rows of a run of so many seconds, and the steps between two of them.
    fn rows(&self, seconds: f64, every: i128) -> PyResult<(u64, u64)> {
        let most = MOST_STEPS * f64::from(self.period.micros()) * 1e-6;
        let seconds = arguments::within("seconds", seconds, 0.0, most, " s")?;
        let every = arguments::whole("every", every, 1, MOST_STEPS as u64)?;
        let steps = (seconds * 1e6 / f64::from(self.period.micros())).round() as u64;
        Ok((steps / every, every))
    }

    fn follower(&mut self) -> PyResult<&mut joint_loop::BoardGenerator> {
        let found = self.built.of_board().filter(|generator| generator.follow_status().is_some());
        found.ok_or_else(|| {
            error::input("this generator follows nobody; allowed is a follower, as `footfall.fit(..., follow='left_hip')` makes it")
        })
    }
}

#[pymethods]
impl Generator {
    /// The default generator of a name: ``phase-coupled`` (the default walk of the boards), ``thesis``, ``thesis-double``, or a network
    /// with ankles or arms: ``six-joints``, ``eight-joints``. ``period_s`` is the control period, s; the boards have 0.001.
    #[classmethod]
    #[pyo3(signature = (name = "phase-coupled", *, period_s = 1e-3))]
    fn default(_: &Bound<'_, PyType>, name: &str, period_s: f64) -> PyResult<Self> {
        let file = GeneratorFile::default_of(name).map(HostGenerator::FourJoints);
        let file = file.or_else(|| NetworkFile::default_of(name).map(HostGenerator::Network));
        let file = file.ok_or_else(|| {
            let allowed = [&GeneratorFile::DEFAULTS[..], &NetworkFile::DEFAULTS].concat().join(", ");
            error::input(format!("name = '{name}': allowed is one of {allowed}"))
        })?;
        Self::new(Definition::File(file), arguments::period(period_s)?)
    }

    /// A gait by its name (``footfall.gaits()`` lists them), at ``speed``, a factor on its own cadence, or at ``cadence``, steps a minute, two a
    /// stride. ``period_s`` is the control period, s.
    #[classmethod]
    #[pyo3(signature = (name, *, speed = None, cadence = None, period_s = 1e-3))]
    fn gait(
        _: &Bound<'_, PyType>,
        name: &str,
        speed: Option<f32>,
        cadence: Option<f32>,
        period_s: f64,
    ) -> PyResult<Self> {
        let gait = arguments::one_of("name", name, Gait::ALL, Gait::name)?;
        let speed = match (speed, cadence) {
            (Some(_), Some(_)) => return Err(error::input("speed and cadence are given; allowed is one of them")),
            (_, Some(cadence)) => gait.speed_at(cadence).map_err(error::input)?,
            (speed, None) => speed.unwrap_or(1.0),
        };
        Self::new(Definition::Gait(gait, speed), arguments::period(period_s)?)
    }

    /// The generator of a file (TOML), as ``footfall fit`` or ``Fit.save`` writes it. ``period_s`` is the control period, s.
    #[classmethod]
    #[pyo3(signature = (path, *, period_s = 1e-3))]
    fn read(_: &Bound<'_, PyType>, path: PathBuf, period_s: f64) -> PyResult<Self> {
        error::can_open(&path)?;
        let file = HostGenerator::read(&path).map_err(|wrong| error::file(&wrong))?;
        Self::new(Definition::File(file), arguments::period(period_s)?)
    }

    /// The generator of the text of a file (TOML); ``name`` stands for the file in errors. ``period_s`` is the control period, s.
    #[classmethod]
    #[pyo3(signature = (text, *, name = "generator.toml", period_s = 1e-3))]
    fn parse(_: &Bound<'_, PyType>, text: &str, name: &str, period_s: f64) -> PyResult<Self> {
        let file = HostGenerator::parse(name, text).map_err(|wrong| error::file(&wrong))?;
        Self::new(Definition::File(file), arguments::period(period_s)?)
    }

    /// Kind of the generator file, or name of the gait; no unit.
    #[getter]
    fn kind(&self) -> &'static str {
        match &self.definition {
            Definition::File(HostGenerator::FourJoints(file)) => file.set.name(),
            Definition::File(HostGenerator::Network(_)) => "phase-coupled",
            Definition::Gait(gait, _) => gait.name(),
        }
    }

    /// Names of the joints, in the order of all arrays; no unit.
    #[getter]
    fn joints(&self) -> Vec<&'static str> {
        match self.built.joints() {
            Joint::COUNT => Joint::ALL.map(Joint::name).to_vec(),
            count => JOINTS[..count].to_vec(),
        }
    }

    /// Joint whose sensor a follower follows, by name; ``None`` for other generators. No unit.
    #[getter]
    fn follows(&self) -> Option<&'static str> {
        self.definition.config().and_then(|config| config.follows()).map(Joint::name)
    }

    /// Control period, s.
    #[getter]
    pub(crate) fn period_s(&self) -> f64 {
        self.seconds(1)
    }

    /// About how long a stride is, s.
    #[getter]
    fn stride_s(&self) -> f64 {
        match &self.definition {
            Definition::File(HostGenerator::FourJoints(file)) => file.set.stride_guess_s(),
            Definition::File(HostGenerator::Network(file)) => file.set.stride_guess_s(),
            Definition::Gait(gait, speed) => f64::from(gait.stride_s() / speed),
        }
    }

    /// Time since the start, s: steps times control period.
    #[getter]
    fn time_s(&self) -> f64 {
        self.seconds(self.steps)
    }

    /// Joint angles now, rad, flexion positive; float32 array of shape (joints,).
    #[getter]
    fn angles_rad<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::column(py, self.four(|built, out| built.angles(out)))
    }

    /// Angular velocities of the joints now, rad/s; float32 array of shape (joints,).
    #[getter]
    fn rates_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::column(py, self.four(|built, out| built.rates(out)))
    }

    /// Phase of the gait in cycles, 0 to below 1.
    #[getter]
    fn phase_cycles(&self) -> f64 {
        cycles(self.built.phase())
    }

    /// Amplitude relative to that of the limit cycle, without unit: 1 on it, 0 at rest.
    #[getter]
    fn amplitude(&self) -> f32 {
        self.built.amplitude()
    }

    /// Status of the tracking (state, fault, rad, s, confidence); ``None`` if the generator follows nobody.
    #[getter]
    fn follow_status<'py>(&mut self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let found = self.built.of_board().and_then(|generator| generator.follow_status());
        found.map(|found| status(py, &found)).transpose()
    }

    /// The text of the generator file (TOML; angles in degrees, times in s). A gait other than a default has none.
    fn to_toml(&self) -> PyResult<String> {
        match &self.definition {
            Definition::File(file) => Ok(file.to_toml()),
            Definition::Gait(gait, _) => Err(error::input(format!(
                "the gait {} has no generator file; allowed are generators of files, of fits and of Generator.default",
                gait.name()
            ))),
        }
    }

    /// Advances by so many control periods (of ``period_s`` s each). An interrupt (Ctrl-C) ends it within about 50 ms, at the step that it has reached.
    #[pyo3(signature = (count = 1))]
    fn step(&mut self, py: Python<'_>, #[pyo3(from_py_with = arguments::integer)] count: i128) -> PyResult<()> {
        let count = arguments::whole("count", count, 0, MOST_STEPS as u64)?;
        let (built, steps) = (&mut self.built, &mut self.steps);
        py.detach(|| {
            let mut interrupts = Interrupts::new();
            for _ in 0..count {
                built.step();
                *steps += 1;
                interrupts.check()?;
            }
            Ok(())
        })
    }

    /// Returns to the start: time 0 s.
    fn reset(&mut self) {
        self.built.reset();
        (self.steps, self.observed) = (0, false);
    }

    /// Raises ``FootfallError`` if a state is not finite or at its bound; the generator then needs ``reset()``. No unit.
    fn check(&self) -> PyResult<()> {
        self.built.check().map_err(error::run)
    }

    /// Steps for so many seconds and returns a ``Motion``: times (s), angles (rad), rates (rad/s) and phase (cycles), one row every ``every`` steps.
    ///
    /// The first row is that after the first ``every`` steps, and the next run continues where this one ends. An interrupt (Ctrl-C) ends it within about
    /// 50 ms, without a ``Motion``: the generator stands at the step that it has reached, and ``time_s`` says which; ``reset()`` goes back to the start.
    #[pyo3(signature = (seconds, *, every = 1))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        seconds: f64,
        #[pyo3(from_py_with = arguments::integer)] every: i128,
    ) -> PyResult<Bound<'py, PyAny>> {
        let start = self.steps;
        let (rows, every) = self.rows(seconds, every)?;
        let width = self.built.joints();
        let capacity = rows as usize * width;
        let (mut angles, mut rates) = (Vec::with_capacity(capacity), Vec::with_capacity(capacity));
        let mut phases = Vec::with_capacity(rows as usize);
        let (built, steps) = (&mut self.built, &mut self.steps);
        py.detach(|| {
            let mut interrupts = Interrupts::new();
            for _ in 0..rows {
                for _ in 0..every {
                    built.step();
                    *steps += 1;
                    interrupts.check()?;
                }
                built.angles(&mut angles);
                built.rates(&mut rates);
                phases.push(cycles(built.phase()));
            }
            Ok::<_, PyErr>(())
        })?;
        let times = (1..=rows).map(|row| self.seconds(start + row * every)).collect();
        let (angles, rates) = (arrays::table(py, angles, width)?, arrays::table(py, rates, width)?);
        arrays::result(
            py,
            "Motion",
            (arrays::column(py, times), angles, rates, arrays::column(py, phases), self.joints()),
        )
    }

    /// Sets the measured angle (rad, flexion positive) of the followed joint for the next step; ``None`` or NaN if the sample is not valid.
    fn observe(&mut self, angle_rad: Option<f32>) -> PyResult<()> {
        let angle = angle_rad.filter(|angle| !angle.is_nan()).map(Radians);
        if angle.is_some_and(|angle| angle.0.is_infinite()) {
            return Err(error::input(
                "angle_rad is infinite; allowed is a finite angle in radians, or None or NaN for no sample",
            ));
        }
        self.follower()?.observe(angle);
        self.observed = true;
        Ok(())
    }

    /// Reports a heel strike for the next step (at ``time_s``, s); a follower without a foot switch ignores it.
    fn heel_strike(&mut self) -> PyResult<()> {
        self.follower()?.heel_strike();
        self.observed = true;
        Ok(())
    }

    /// Feeds a follower one measured angle (rad) a control period, shape (n,), and returns a ``Following``: phase (cycles), stride time (s),
    /// stride frequency (Hz), state, fault, confidence and the joints' angles (rad) over time (s).
    ///
    /// NaN is a sample that is not valid. ``heel_strikes``: rows at which the foot switch closed. An interrupt (Ctrl-C) ends it within about 50 ms, without
    /// a ``Following``: the follower stands behind the last sample that it took, and ``time_s`` says which.
    #[pyo3(signature = (angles_rad, *, heel_strikes = None))]
    fn follow<'py>(
        &mut self,
        py: Python<'py>,
        angles_rad: &Bound<'py, PyAny>,
        heel_strikes: Option<Vec<Whole>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let samples = arrays::given("angles_rad", angles_rad, None)?.values;
        if let Some(row) = samples.iter().position(|angle| angle.is_infinite()) {
            return Err(error::input(format!(
                "angles_rad[{row}] is infinite; allowed are finite angles in radians, and NaN for no sample"
            )));
        }
        let strikes = heel_strikes.unwrap_or_default();
        let mut is_strike = vec![false; samples.len()];
        for Whole(row) in strikes {
            let place = usize::try_from(row).ok().and_then(|row| is_strike.get_mut(row));
            *place.ok_or_else(|| {
                error::input(format!(
                    "heel_strikes has row {row}: allowed are the rows of angles_rad, from 0 to below {}",
                    samples.len()
                ))
            })? = true;
        }
        let start = self.steps;
        self.follower()?;
        self.observed = true;
        let steps = &mut self.steps;
        let Some(follower) = self.built.of_board() else { return Err(error::input("no generator of a board")) };
        let (mut angles, mut phases, mut statuses) = (Vec::new(), Vec::new(), Statuses::default());
        py.detach(|| {
            let mut interrupts = Interrupts::new();
            for (sample, is_strike) in samples.iter().zip(is_strike) {
                follower.observe((!sample.is_nan()).then_some(Radians(*sample as f32)));
                if is_strike {
                    follower.heel_strike();
                }
                Stepped::step(follower);
                Stepped::angles(follower, &mut angles);
                phases.push(cycles(Stepped::phase(follower)));
                statuses.extend(follower.follow_status());
                *steps += 1;
                interrupts.check()?;
            }
            Ok::<_, PyErr>(())
        })?;
        let times = (1..=samples.len() as u64).map(|row| self.seconds(start + row)).collect();
        let [state, fault, phase_error, stride_s, confidence] = statuses.columns(py);
        let (states, faults) = names();
        let angles = arrays::table(py, angles, Joint::COUNT)?;
        let fields = (
            arrays::column(py, times),
            angles,
            arrays::column(py, phases),
            (state, states),
            (fault, faults),
            phase_error,
            stride_s,
            confidence,
        );
        arrays::result(py, "_following", fields)
    }

    fn __repr__(&self) -> String {
        let (kind, joints, at) = (self.kind(), self.built.joints(), self.seconds(self.steps));
        format!("<footfall.Generator {kind}, {joints} joints, at {at:.3} s>")
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let py = slf.py();
        let this = slf.borrow();
        if this.observed {
            return Err(error::run(
                "a follower that has been given measurements cannot be pickled: its state depends on them; allowed is it after reset()",
            ));
        }
        let text = match &this.definition {
            Definition::File(file) => (file.to_toml(), None),
            Definition::Gait(gait, speed) => (gait.name().to_owned(), Some(*speed)),
        };
        let restore = slf.get_type().getattr("_restore")?;
        let arguments = (text.0, text.1, this.period.micros(), this.steps).into_pyobject(py)?.into_any();
        Ok((restore, arguments))
    }

    /// Restores a pickled generator (period in us, time in steps).
    #[classmethod]
    fn _restore(
        _: &Bound<'_, PyType>,
        py: Python<'_>,
        text: &str,
        speed: Option<f32>,
        micros: u32,
        steps: u64,
    ) -> PyResult<Self> {
        let definition = match speed {
            Some(speed) => Definition::Gait(arguments::one_of("name", text, Gait::ALL, Gait::name)?, speed),
            None => Definition::File(HostGenerator::parse("pickle", text).map_err(|wrong| error::file(&wrong))?),
        };
        let mut made = Self::new(definition, arguments::period(f64::from(micros) * 1e-6)?)?;
        let built = &mut made.built;
        py.detach(|| (0..steps).for_each(|_| built.step()));
        made.steps = steps;
        Ok(made)
    }
}

/// The gaits by name: a dictionary from the name to what it is, with its stride time in s and its cadences in steps a minute.
#[pyfunction]
pub(crate) fn gaits(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    let all: serde_json::Map<String, serde_json::Value> = Gait::ALL
        .into_iter()
        .map(|gait| {
            let ((slowest, fastest), (least, most)) = (gait.cadences(), gait.speeds());
            let about = serde_json::json!({
                "description": gait.description(),
                "stride_s": gait.stride_s(),
                "cadences_steps_per_min": [slowest, fastest],
                "speeds": [least, most],
            });
            (gait.name().to_owned(), about)
        })
        .collect();
    arrays::plain(py, &all)
}
