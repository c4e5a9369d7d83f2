//! `fit` and `Fit`: a generator fitted to a recording, with its errors on strides that were not fitted.

use cpg_core::entrainment::EventSource;
use gait_fit::fit::{self as gait, Kind, Settings, Source};
use gait_fit::judge::JointFit;
use gait_fit::report;
use gait_trace::Cycle;
use gait_trace::stride::cycle::POINTS;
use joint_loop::SERIES_HARMONICS;
use joint_units::{Joint, Period};
use pyo3::prelude::*;
use std::path::{Path, PathBuf};

use crate::arguments::Whole;
use crate::certificate::Certificate;
use crate::generator::Generator;
use crate::recording::{Asked, LowPassArgument, Recording, findings};
use crate::{arguments, arrays, error, interrupt};

/// A generator fitted to a recording: parameters, errors per joint (deg), strides (rad), certificate.
///
/// Arrays of joints have the order left hip, right hip, left knee, right knee. The errors on held-out strides are of separate fits by the same
/// method; their floor is the person's own variability.
#[pyclass(frozen, module = "footfall")]
pub(crate) struct Fit {
    fitted: gait::Fit,
}

impl Fit {
    fn errors<'py>(&self, py: Python<'py>, error: impl Fn(&JointFit) -> Option<f64>) -> Option<Bound<'py, PyAny>> {
        let errors: Option<Vec<f64>> = self.fitted.joints.iter().map(error).collect();
        errors.map(|errors| arrays::column(py, errors))
    }

    /// The arguments that change that the generator is not used, and what they do.
    fn remedy(&self) -> &'static str {
        match (&self.fitted.refused, self.fitted.certificate.drive.walks) {
            (Some(_), _) => "kind='shape' fits another kind, seed and evaluations search elsewhere",
            (None, true) => "follow or events chooses another sensor or its events",
            (None, false) => "fit_limits=True fits it into the limits",
        }
    }
}

/// The angles of a cycle, rad, shape (200, 4).
fn cycle<'py>(py: Python<'py>, cycle: &Cycle) -> PyResult<Bound<'py, PyAny>> {
    let rows = (0..POINTS).flat_map(|point| cycle.0.map(|joint| joint[point].to_radians())).collect();
    arrays::table(py, rows, Joint::COUNT)
}

#[pymethods]
impl Fit {
    /// The fitted generator at its start, at a control period of 0.001 s.
    fn generator(&self) -> PyResult<Generator> {
        Generator::of_file(self.fitted.file.clone(), Period::MILLISECOND)
    }

    /// The text of the generator file (TOML; angles in degrees, times in s).
    fn to_toml(&self) -> String {
        self.fitted.file.to_toml()
    }

    /// Writes the generator file (TOML; angles in degrees, times in s).
    ///
    /// Where ``not_used_because`` says why the program would not write it, it raises ``FootfallError`` and writes nothing; ``force=True`` writes it as it is.
    #[pyo3(signature = (path, *, force = false))]
    fn save(&self, path: PathBuf, force: bool) -> PyResult<()> {
        if let Some(why) = self.fitted.not_used_because().filter(|_| !force) {
            return Err(error::run(format!(
                "{why}; no generator is written; {}, force=True writes it as it is",
                self.remedy()
            )));
        }
        error::write(&path, &self.fitted.file.to_toml())
    }

    /// The report as one page of HTML, with numbers (deg, s) and pictures.
    fn report(&self) -> String {
        report::html(&self.fitted, "footfall.fit(...).report()")
    }

    /// Stride period of the generator, s.
    #[getter]
    fn stride_s(&self) -> f64 {
        self.fitted.period_s
    }

    /// Root mean square error against the person's mean stride, deg; float64 array of shape (4,).
    #[getter]
    fn rmse_deg<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.errors(py, |joint| Some(joint.rmse_mean_stride_deg))
    }

    /// Root mean square error on strides that were not fitted, deg; float64 array of shape (4,), or ``None`` if there is only one stride.
    #[getter]
    fn heldout_rmse_deg<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.errors(py, |joint| joint.rmse_heldout_deg)
    }

    /// The same error of the mean of the fitted strides, deg: the person's own variability; float64 array of shape (4,), or ``None``.
    #[getter]
    fn heldout_floor_deg<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.errors(py, |joint| joint.heldout_floor_deg)
    }

    /// Standard deviation of the strides about their mean, deg; float64 array of shape (4,), or ``None`` if there is only one stride.
    #[getter]
    fn stride_sd_deg<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.errors(py, |joint| joint.stride_sd_deg)
    }

    /// How the held-out strides were chosen, in words; no unit.
    #[getter]
    fn held_out(&self) -> &'static str {
        self.fitted.held_out.words()
    }

    /// The strides of the recording, rad; float64 array of shape (strides, 200, 4), each resampled to 200 points of its cycle.
    #[getter]
    fn strides_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let cycles = self.fitted.strides.cycles();
        let points = |cycle: &Cycle| -> Vec<f64> {
            (0..POINTS).flat_map(|point| cycle.0.map(|joint| joint[point].to_radians())).collect()
        };
        let values: Vec<f64> = cycles.iter().flat_map(points).collect();
        arrays::column(py, values).call_method1("reshape", (cycles.len(), POINTS, Joint::COUNT))
    }

    /// Spans of the strides, s from the first row of the recording: list of (start, end).
    #[getter]
    fn stride_spans_s(&self) -> Vec<(f64, f64)> {
        self.fitted.strides.spans.iter().map(|span| (span.start_s, span.end_s)).collect()
    }

    /// The mean stride of the person, rad; float64 array of shape (200, 4).
    #[getter]
    fn mean_stride_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        cycle(py, &self.fitted.strides.mean())
    }

    /// One stride of the generator, aligned with the mean stride, rad; float64 array of shape (200, 4).
    #[getter]
    fn generator_stride_rad<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        cycle(py, &self.fitted.cycle)
    }

    /// The certificate of the generator, with the reasons why it is refused (numbers with units in their texts).
    #[getter]
    fn certificate(&self) -> PyResult<Certificate> {
        Certificate::of(&self.fitted.certificate)
    }

    /// Why the program ``footfall fit`` would not write the generator, with numbers and units; ``None`` if it would.
    #[getter]
    fn not_used_because(&self) -> Option<String> {
        self.fitted.not_used_because()
    }

    /// Defects of the recording, with what was done: list of ``Finding`` with times in s.
    #[getter]
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        findings(py, &self.fitted.conditioned.findings)
    }

    /// Notes for the user, one sentence each, with their units.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.fitted.notes.clone()
    }

    /// Every number of the fit as plain data, for tables and other processes: errors, measures and certificate; units are in the keys.
    fn as_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let fitted = &self.fitted;
        let all = serde_json::json!({
            "source": fitted.source.name,
            "source_sha256": fitted.source.sha256,
            "settings": fitted.settings.to_string(),
            "generator": fitted.file.set.name(),
            "stride_s": fitted.period_s,
            "joints": fitted.joints,
            "held_out": fitted.held_out,
            "measures": fitted.measures,
            "certificate": fitted.certificate,
            "limits_cost_deg": fitted.limits_cost_deg,
            "not_used_because": fitted.not_used_because(),
            "notes": fitted.notes,
        });
        arrays::plain(py, &all)
    }

    fn __repr__(&self) -> String {
        let Settings { generator, .. } = self.fitted.settings;
        format!(
            "<footfall.Fit {} to {}, stride {:.4} s>",
            generator.name(),
            self.fitted.source.name,
            self.fitted.period_s
        )
    }
}

/// Fits a generator to a recording and returns a ``Fit``: errors in deg, strides in rad, shape (200, 4).
///
/// ``recording``: a ``Recording``, or the path of a file. ``kind``: ``shape`` (phase and Fourier series), ``phase-coupled`` (R1) or ``thesis``.
/// ``harmonics``: of the shape, 1 to 8. ``follow``: the joint with the gait sensor, for a follower. ``events``: stride events that the follower
/// uses, ``none``, ``peak`` or ``foot_switch``. ``low_pass``, ``knee_sign``, ``hip_sign`` and ``stride_s`` (s): see ``Recording.condition``. ``robot``: a
/// robot file. ``fit_limits``: scale and shift the joints into the limits of the robot. ``seed`` and ``evaluations``: of the search for
/// the thesis' parameters. ``starts``: random starts of the certificate. An interrupt (Ctrl-C) ends it within about 50 ms and changes nothing; its
/// computation ends with its stage.
#[pyfunction]
#[pyo3(signature = (recording, *, kind = "shape", harmonics = None, follow = None, events = "none", corrections = true,
    low_pass = LowPassArgument::Name("customary".into()), knee_sign = None, hip_sign = None, stride_s = None, robot = None, fit_limits = false, seed = 1,
    evaluations = 60_000, starts = 1000))]
#[allow(clippy::too_many_arguments)] // They are keywords in Python.
pub(crate) fn fit(
    py: Python<'_>,
    recording: &Bound<'_, PyAny>,
    kind: &str,
    harmonics: Option<Whole>,
    follow: Option<&str>,
    events: &str,
    corrections: bool,
    low_pass: LowPassArgument,
    knee_sign: Option<&str>,
    hip_sign: Option<&str>,
    stride_s: Option<f64>,
    robot: Option<PathBuf>,
    fit_limits: bool,
    #[pyo3(from_py_with = arguments::integer)] seed: i128,
    #[pyo3(from_py_with = arguments::integer)] evaluations: i128,
    #[pyo3(from_py_with = arguments::integer)] starts: i128,
) -> PyResult<Fit> {
    let kind = arguments::one_of("kind", kind, Kind::ALL, Kind::name)?;
    let for_shape = [("harmonics", harmonics.is_some()), ("follow", follow.is_some())];
    if let Some((name, _)) = for_shape.into_iter().find(|(_, given)| *given && kind != Kind::Shape) {
        return Err(error::input(format!(
            "{name} with kind = '{}': allowed is {name} with kind = 'shape' only",
            kind.name()
        )));
    }
    let events = arguments::one_of("events", events, EventSource::ALL, EventSource::name)?;
    if follow.is_none() && events != EventSource::None {
        return Err(error::input(format!(
            "events = '{}' without follow: allowed is events with follow",
            events.name()
        )));
    }
    if kind == Kind::Thesis && fit_limits {
        return Err(error::input(
            "fit_limits with kind = 'thesis', whose joints cannot be scaled one by one: allowed is it with shape or phase-coupled",
        ));
    }
    let harmonics =
        harmonics.map(|count| arguments::whole("harmonics", count, 1, SERIES_HARMONICS as u64)).transpose()?;
    let asked = Asked::of(low_pass, knee_sign, hip_sign, stride_s)?;
    let recording = match recording.cast::<Recording>() {
        Ok(recording) => recording.clone(),
        Err(_) => Bound::new(py, crate::recording::of_path(py, recording.extract()?)?)?,
    };
    let recording = recording.get();
    let (rules, note) = asked.rules(&recording.recorded)?;
    let settings = Settings {
        generator: kind,
        harmonics: harmonics.map(|count| count as usize),
        seed: arguments::whole("seed", seed, 0, u64::MAX)?,
        evaluations: arguments::whole("evaluations", evaluations, 1_000, 100_000_000)? as usize,
        starts: arguments::whole("starts", starts, 1, 100_000)? as u32,
        rules,
        follow: follow.map(|name| arguments::joint("follow", name)).transpose()?,
        events,
        corrections,
        robot: arguments::robot(robot.as_deref())?,
        fit_limits,
        ..Settings::default()
    };
    let raw = recording.raw()?;
    let name = Path::new(&recording.recorded.name).file_name().map(|name| name.to_string_lossy().into_owned());
    let source = Source {
        name: name.unwrap_or_else(|| recording.recorded.name.clone()),
        sha256: recording.recorded.sha256.clone(),
    };
    let raw = raw.clone();
    let fitted = interrupt::beside(py, move |stage| gait::fit(&source, &raw, &settings, stage))?;
    let mut fitted = fitted.map_err(error::input)?;
    fitted.notes.extend(note);
    arrays::result(py, "_warn", (findings(py, &fitted.conditioned.findings)?,))?;
    Ok(Fit { fitted })
}
