//! A knee's sensor with a fault, as volts that the virtual board is fed with, and when the board's converter looks at them.

use crate::board::{Board, Ran};
use crate::degraded::Random;
use crate::gestures;
use crate::recordings::default_volts;
use firmware::board::GENERATOR_SECTOR;
use gait_trace::Recording;
use hgod_adc::Validity;
use joint_loop::store::generator_record::record_of;
use joint_loop::{FaultResponse, Frame, GeneratorConfig, RecordName, SENSORS, fault_response};
use std::ffi::OsString;
use std::path::Path;

/// Volts of the board's supply.
pub const SUPPLY: f64 = 3.0;

/// Volts of one code.
pub const LSB: f64 = SUPPLY / 4095.0;

/// Near the two ends of the table, -46 and 77 degrees.
const ENDS: [f64; 2] = [0.86, 2.52];

/// What happens at the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The wire comes off; the pull-down takes the pin to ground.
    Open,
    /// The wire touches the supply.
    Short,
    /// The same as open, for 15 ms.
    Brief,
    /// The volts stay as they are.
    Stuck,
    /// Half a volt for 1.25 ms, which is five conversions.
    Spike,
    /// To the farther end of the table, and there it stays: a strap that slips.
    Jump,
    /// At the farther end for 5 of 7 ms: a loose contact.
    Loose,
    /// Beyond the table, clear of the end bands: below it, above it.
    Outside,
    /// The converter's supply falls to 2.6 V, where 2.7 V are wanted.
    Supply,
}

impl Fault {
    /// What it is called.
    #[must_use]
    pub fn verdict(self) -> Validity {
        match self {
            Self::Open => Validity::Open,
            Self::Short => Validity::Short,
            Self::Brief => Validity::Saturated,
            Self::Stuck => Validity::Stuck,
            Self::Spike => Validity::Spike,
            Self::Jump | Self::Loose => Validity::Rate,
            Self::Outside => Validity::OutOfTable,
            Self::Supply => Validity::SupplyLow,
        }
    }

    /// How long it lasts, s.
    #[must_use]
    pub fn lasts(self) -> f64 {
        match self {
            Self::Brief => 0.015,
            Self::Spike => 0.00125,
            _ => f64::INFINITY,
        }
    }

    /// What the verdict leads to.
    ///
    /// # Panics
    /// Never: it is not good.
    #[must_use]
    pub fn reaction(self) -> FaultResponse {
        fault_response(self.verdict()).expect("something follows")
    }

    /// Volts at the sensor's pin, `since` seconds after the fault began, where a sound sensor gives `sound` now and gave `then` at the
    /// beginning.
    fn volts(self, since: f64, sound: f64, then: f64) -> f64 {
        let middle = (ENDS[0] + ENDS[1]) / 2.0;
        let away = if then > middle { ENDS[0] } else { ENDS[1] };
        match self {
            Self::Open | Self::Brief => 0.0,
            Self::Short => SUPPLY,
            Self::Stuck => then,
            Self::Spike => sound + if then > middle { -0.5 } else { 0.5 },
            Self::Jump => away,
            Self::Loose => {
                if (since * 1e3 + 1e-6) as u32 % 7 < 5 {
                    away
                } else {
                    sound
                }
            }
            Self::Outside => {
                if then > 1.8 {
                    2.75
                } else {
                    0.4
                }
            }
            Self::Supply => sound,
        }
    }
}

/// The knee of the default recording as volts, repeated without end, with noise.
#[derive(Debug)]
pub struct Knee {
    volts: Recording,
    noise: Vec<f64>,
}

impl Knee {
    /// For so many seconds. Noise of this standard deviation in codes, a new value each millisecond.
    #[must_use]
    pub fn new(noise: f64, secs: f64, seed: u32) -> Self {
        let mut random = Random(seed);
        let noise = (0..=(secs * 1e3) as usize + 2).map(|_| noise * LSB * random.normal()).collect();
        Self { volts: default_volts(), noise }
    }

    /// Of the loop, which is two strides.
    #[must_use]
    pub fn stride_s(&self) -> f64 {
        self.volts.duration_s() / 2.0
    }

    fn at(&self, time: f64) -> f64 {
        let (n, part) = ((time * 1e3) as usize, (time * 1e3).fract());
        let noise = self.noise[n] + part * (self.noise[n + 1] - self.noise[n]);
        self.volts.at(&self.volts.channels()[0], time % self.volts.duration_s()) + noise
    }
}

/// The table that the virtual board is fed with: the knee, with faults from these times on.
#[must_use]
pub fn table(knee: &Knee, faults: &[(Fault, f64)], secs: f64) -> String {
    // Just before: the table is linear from row to row.
    let before = 1e-7;
    let mut times: Vec<f64> = (0..=(secs * 1e3) as u32).map(|ms| f64::from(ms) * 1e-3).collect();
    for &(fault, at) in faults {
        let mut edges = vec![at];
        match fault {
            Fault::Loose => edges.extend((1..1000).map(|ms| at + f64::from(ms) * 1e-3).filter(|&edge| edge < secs)),
            _ if fault.lasts().is_finite() => edges.push(at + fault.lasts()),
            _ => {}
        }
        times.extend(edges.into_iter().flat_map(|edge| [edge - before, edge]));
    }
    times.sort_by(f64::total_cmp);
    times.dedup_by(|later, earlier| *later - *earlier < before / 2.0);
    let mut text = String::from("time_s,PA1,VDDA\n");
    for time in times {
        let on = faults.iter().rfind(|(fault, at)| (*at..at + fault.lasts()).contains(&(time + before / 4.0)));
        let sound = knee.at(time);
        let pin = on.map_or(sound, |(fault, at)| fault.volts(time - at, sound, knee.at(*at)));
        let supply = if on.is_some_and(|(fault, _)| *fault == Fault::Supply) { 2.6 } else { SUPPLY };
        text += &format!("{time:.8},{pin:.6},{supply}\n");
    }
    text
}

/// A board with a generator, in its parameter sector unless it is the built-in one.
#[derive(Debug)]
pub struct Rig<'a> {
    board: &'a Board,
    /// The generator.
    pub generator: GeneratorConfig,
    sector: Option<tempfile::NamedTempFile>,
    /// When its converter looks at the pin.
    pub clock: Clock,
}

impl<'a> Rig<'a> {
    /// A board that runs this generator.
    ///
    /// # Panics
    /// The board cannot be run.
    #[must_use]
    pub fn new(board: &'a Board, generator: GeneratorConfig, built_in: bool) -> Self {
        let sector = (!built_in).then(|| {
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), record_of(&generator, &RecordName::BUILT_IN).bytes()).unwrap();
            file
        });
        let mut rig = Self { board, generator, sector, clock: Clock { first_s: 0.0 } };
        // Four conversions a tick, 0.25 ms apart, from tick 1 on: by the converter's model itself.
        let folder = tempfile::tempdir().unwrap();
        let (feed, file) = (folder.path().join("volts.csv"), folder.path().join("conversions.csv"));
        std::fs::write(&feed, "time_s,PA1\n0,1.5\n").unwrap();
        let mut options = rig.options(&feed, 0.1);
        options.extend(["--record-conversions".into(), file.clone().into()]);
        let _ = board.run_with(&rig.generator, options);
        let text = std::fs::read_to_string(file).unwrap();
        let row = text.lines().find(|line| line.contains("ADC1_IN1,")).expect("a conversion");
        // The result is there 12 cycles of 21 MHz after the end of the sampling.
        rig.clock.first_s = row.split(',').next().unwrap().parse::<f64>().unwrap() - 12.0 / 21e6;
        rig
    }

    fn options(&self, feed: &Path, secs: f64) -> Vec<OsString> {
        let mut options: Vec<OsString> = ["--secs".into(), secs.to_string().into()].into();
        options.extend(gestures::options([gestures::ARM]).chain(["--volts".into(), feed.into()]));
        if let Some(sector) = &self.sector {
            options.extend(["--flash".into(), format!("{GENERATOR_SECTOR:#010x}={}", sector.path().display()).into()]);
        }
        options
    }

    /// Runs the board on a table of volts, armed at once; every line of its log is equal to the host's replay, and the chip's models were enough.
    ///
    /// # Panics
    /// They are not.
    #[must_use]
    pub fn run(&self, text: &str, secs: f64) -> (Ran, Vec<Frame<SENSORS>>) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("volts.csv");
        std::fs::write(&file, text).unwrap();
        let ran = self.board.run_with(&self.generator, self.options(&file, secs));
        assert_eq!((ran.code, ran.end.unmodelled, ran.end.lints.len(), ran.boots.len()), (Some(0), 0, 0, 1));
        let books = &ran.books;
        let all = (books.different, books.not_compared, books.lost_lines, books.malformed);
        assert_eq!(all, (0, 0, 0, 0), "{:?}", books.differences);
        assert!(books.compared > 200 && books.hashes.is_some_and(|(board, host)| board == host));
        let frames = ran.boots[0].replay(&self.generator);
        assert!(frames.iter().zip(1..).all(|(frame, tick)| frame.tick == tick), "a tick is missing");
        (ran, frames)
    }
}

/// When the converter looks at the pin.
#[derive(Debug)]
pub struct Clock {
    /// The end of the first conversion's sampling in tick 1, s.
    first_s: f64,
}

impl Clock {
    /// One of the four conversions of a tick, s.
    #[must_use]
    pub fn conversion(&self, tick: u32, which: u32) -> f64 {
        self.first_s + (f64::from(tick) - 1.0) * 1e-3 + f64::from(which) * 250e-6
    }

    /// The first tick whose code is wholly the fault's: at least three conversions, of which the mean leaves out the extremes.
    ///
    /// # Panics
    /// Never.
    #[must_use]
    pub fn first_wrong(&self, at: f64) -> u32 {
        (1..).find(|&tick| self.conversion(tick, 1) >= at).expect("time goes on")
    }

    /// A moment 0.1 ms before a conversion, near a time: before the first, second, third, fourth of a tick in turn.
    #[must_use]
    pub fn moment(&self, near: f64, turn: u32) -> f64 {
        let tick = ((near - self.first_s) * 1e3) as u32 + 1;
        self.conversion(tick, turn % 4) - 100e-6
    }

    /// Milliseconds from a moment to the last conversion of a tick, which starts it.
    #[must_use]
    pub fn ms(&self, from: f64, tick: u32) -> f64 {
        (self.conversion(tick, 3) - from) * 1e3
    }
}
