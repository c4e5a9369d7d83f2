//! What can be certified: the set of a generator file, a gait by name, or a model of the catalogue.

use cpg_core::gait::catalogue;
use cpg_core::gait::named::Gait;
use cpg_core::{BuildError, Generator};
use joint_units::Period;

use crate::file::{GeneratorFile, GeneratorSet};
use crate::led::Led;
use crate::model::{Model, Single, model};
use crate::orbit::{Motion, motion};

/// Steps a stride of the simulations.
const STEPS: f64 = 200.0;
/// Largest relative difference of the period to that at half the step.
const SAME_PERIOD: f64 = 2e-5;

/// What is certified.
// There are few of them.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq)]
pub enum Subject {
    /// The set of a generator file.
    Set(GeneratorSet),
    /// A default gait.
    Gait(Gait),
    /// A model of [`cpg_core::gait::catalogue`].
    Catalogue(&'static str),
}

/// Models of the catalogue, with what they are.
const CATALOGUE: [(&str, &str); 16] = [
    ("robust", "R1, the default walk"),
    ("thesis", "the thesis' network, Table 1, set S"),
    ("van-der-pol", "a half-centre of two van der Pol oscillators"),
    ("hopf", "a half-centre of two Hopf oscillators"),
    ("adaptive-hopf", "one Hopf oscillator that takes on the frequency of its input"),
    ("matsuoka", "four Matsuoka neurons"),
    ("half-centre", "two half-centres of Matsuoka neurons"),
    ("fitzhugh-nagumo", "a half-centre of two FitzHugh-Nagumo neurons"),
    ("morris-lecar", "a half-centre of two Morris-Lecar neurons"),
    ("terman-wang", "a half-centre of two Terman-Wang oscillators"),
    ("golubitsky", "four symmetric cells, walk"),
    ("obb", "the oscillatory building block"),
    ("programmable", "a bank of four Hopf oscillators"),
    ("adaptive-fourier", "one phase, six harmonics a joint that can learn"),
    ("fourier", "one phase, six harmonics a joint"),
    ("spline", "one phase, twelve knots a joint"),
];

/// A model that has settled.
pub struct Settled {
    /// The model, built at the step of the simulations.
    pub model: Box<dyn Model>,
    /// Its motion.
    pub motion: Motion,
}

impl Subject {
    /// The subject of a name: a default of [`GeneratorFile`], a gait or a model of the catalogue.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let of_file = || GeneratorFile::default_of(name).map(|file| Self::Set(file.set));
        let gait = || Gait::from_name(name).map(Self::Gait);
        let catalogue = || CATALOGUE.iter().find(|entry| entry.0 == name).map(|entry| Self::Catalogue(entry.0));
        of_file().or_else(gait).or_else(catalogue).map(Self::or_default_set)
    }

    /// Every name, each once, with what it is.
    #[must_use]
    pub fn names() -> Vec<(&'static str, String)> {
        let mut all: Vec<(&'static str, String)> =
            GeneratorFile::DEFAULTS.iter().map(|name| (*name, "default of a generator file".into())).collect();
        all.extend(
            Gait::ALL
                .map(|gait| (gait.name(), format!("gait, stride {:.3} s: {}", gait.stride_s(), gait.description()))),
        );
        all.extend(CATALOGUE.map(|(name, words)| (name, format!("catalogue: {words}"))));
        let mut known = vec![];
        all.retain(|(name, _)| {
            let first = !known.contains(name);
            known.push(*name);
            first
        });
        all
    }

    /// Those that are a default set, as that set.
    fn or_default_set(self) -> Self {
        let default = |name: &str| GeneratorFile::default_of(name).map(|file| Self::Set(file.set));
        match self {
            Self::Gait(Gait::Walk) | Self::Catalogue("robust") => default("phase-coupled").unwrap_or(self),
            Self::Gait(Gait::Thesis) | Self::Catalogue("thesis") => default("thesis").unwrap_or(self),
            other => other,
        }
    }

    /// Kind of the set, or name of gait or model.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Set(set) => set.name(),
            Self::Gait(gait) => gait.name(),
            Self::Catalogue(name) => name,
        }
    }

    /// About how long a stride is, seconds.
    #[must_use]
    pub fn stride_guess_s(&self) -> f64 {
        match self {
            Self::Set(set) => set.stride_guess_s(),
            Self::Gait(gait) => f64::from(gait.stride_s()),
            Self::Catalogue(_) => f64::from(catalogue::STRIDE_S),
        }
    }

    /// The generator as it runs on a board, in `f32`; a follower gets the angles of a simulated person.
    ///
    /// # Errors
    /// It cannot be built; the text says why.
    pub(crate) fn led(&self, period: Period) -> Result<Led, String> {
        match self {
            Self::Set(set) => Led::new(set, period),
            Self::Gait(gait) => named(gait.build(1.0, period)),
            Self::Catalogue(name) => match *name {
                "robust" => named(catalogue::robust(period)),
                "thesis" => named(catalogue::thesis(period)),
                "van-der-pol" => named(catalogue::van_der_pol(period)),
                "hopf" => named(catalogue::hopf(period)),
                "adaptive-hopf" => named(catalogue::adaptive_hopf(period)),
                "matsuoka" => named(catalogue::matsuoka(period)),
                "half-centre" => named(catalogue::half_centre(period)),
                "fitzhugh-nagumo" => named(catalogue::fitzhugh_nagumo(period)),
                "morris-lecar" => named(catalogue::morris_lecar(period)),
                "terman-wang" => named(catalogue::terman_wang(period)),
                "golubitsky" => named(catalogue::golubitsky(period)),
                "obb" => named(catalogue::obb(period)),
                "programmable" => named(catalogue::programmable(period)),
                "adaptive-fourier" => named(catalogue::adaptive_fourier(period)),
                "fourier" => named(catalogue::fourier(period)),
                "spline" => named(catalogue::spline(period)),
                other => Err(format!("no model `{other}`")),
            },
        }
    }

    /// The model; `None` if its only state is a phase.
    ///
    /// # Errors
    /// The generator cannot be built; the text says why.
    pub fn model(&self, period: Period) -> Result<Option<Box<dyn Model>>, String> {
        fn single<G: crate::model::FlowStates>(built: Result<G, BuildError>) -> Result<Option<Box<dyn Model>>, String> {
            Ok(Some(Box::new(Single(built.map_err(|error| error.to_string())?))))
        }
        match self {
            Self::Set(set) => model(set, period),
            Self::Gait(gait) => match gait.build(1.0, period).map_err(|error| error.to_string())? {
                cpg_core::gait::named::DefaultGait::Cells(cells) => single(Ok(cells)),
                _ => Ok(None),
            },
            Self::Catalogue(name) => match *name {
                "van-der-pol" => single(catalogue::van_der_pol(period)),
                "hopf" => single(catalogue::hopf(period)),
                "adaptive-hopf" => single(catalogue::adaptive_hopf(period)),
                "matsuoka" => single(catalogue::matsuoka(period)),
                "half-centre" => single(catalogue::half_centre(period)),
                "fitzhugh-nagumo" => single(catalogue::fitzhugh_nagumo(period)),
                "morris-lecar" => single(catalogue::morris_lecar(period)),
                "terman-wang" => single(catalogue::terman_wang(period)),
                "golubitsky" => single(catalogue::golubitsky(period)),
                "programmable" => single(catalogue::programmable(period)),
                _ => Ok(None),
            },
        }
    }

    /// The motion that it settles on; `None` if its only state is a phase.
    ///
    /// # Errors
    /// The generator cannot be built; the text says why.
    pub fn motion(&self) -> Result<Option<Settled>, String> {
        settle(self.stride_guess_s(), |period| self.model(period))
    }
}

/// The motion that a model settles on, for a stride of about `stride_s`; `None` if its only state is a phase. The step is a part of the
/// stride, and at most what the generator allows; it is halved until the period does not depend on it.
pub(crate) fn settle(
    stride_s: f64,
    build: impl Fn(Period) -> Result<Option<Box<dyn Model>>, String>,
) -> Result<Option<Settled>, String> {
    let stride_micros = 1e6 * stride_s;
    let mut micros = (stride_micros / STEPS).clamp(1.0, f64::from(Period::MAX_MICROS)) as u32;
    let finest = (micros / 8).max(1);
    let mut coarser: Option<(f64, Settled)> = None;
    loop {
        let period = Period::from_micros(micros).ok_or("no such step")?;
        let model = match build(period) {
            Ok(None) => return Ok(None),
            Ok(Some(model)) => model,
            // A stiff model allows only shorter steps. All that can be read from a file run at 1 ms.
            Err(_) if micros > 1_000 => {
                micros = (micros / 2).max(1_000);
                continue;
            }
            Err(why) => return Err(why),
        };
        let mut motion = motion(model.as_ref(), (stride_micros / f64::from(micros)).ceil() as usize);
        let Motion::Periodic(orbit) = &mut motion else { return Ok(Some(Settled { model, motion })) };
        let period_s = orbit.steps * f64::from(micros) * 1e-6;
        orbit.period_s = period_s;
        let is_double = model.is_double();
        let settled = Settled { model, motion };
        match coarser {
            Some((known, before)) if (known / period_s - 1.0).abs() < SAME_PERIOD => return Ok(Some(before)),
            // In single precision a smaller step has no smaller error.
            _ if !is_double || micros <= finest => return Ok(Some(settled)),
            _ => coarser = Some((period_s, settled)),
        }
        micros /= 2;
    }
}

fn named<G: Generator<4> + Clone + 'static>(built: Result<G, BuildError>) -> Result<Led, String> {
    built.map(Led::named).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use cpg_core::joints::features::Features;

    /// Every name of the three lists is found, and every model of the catalogue has one.
    #[test]
    fn every_generator_has_a_name() {
        struct Names(Vec<&'static str>);
        impl catalogue::Visitor for Names {
            fn generator<G: Generator<4> + Features + Clone>(&mut self, name: &'static str, _: Result<G, BuildError>) {
                self.0.push(name);
            }
        }
        let mut names = Names(vec![]);
        catalogue::each(Period::MILLISECOND, &mut names);
        names.0.extend(Gait::ALL.map(Gait::name));
        names.0.extend(GeneratorFile::DEFAULTS);
        let listed = Subject::names();
        for name in names.0 {
            assert!(listed.iter().any(|entry| entry.0 == name), "{name}");
            let subject = Subject::named(name).expect(name);
            let mut led = subject.led(Period::MILLISECOND).expect(name);
            led.step();
            assert!(led.angles().iter().all(|angle| angle.0.is_finite()), "{name}");
        }
        assert_eq!(Subject::named("canter"), None);
        assert!(listed.iter().enumerate().all(|(n, a)| listed[..n].iter().all(|b| a.0 != b.0)));
    }
}
