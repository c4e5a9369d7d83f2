//! The result of a soak, as a table and as JSON.

use std::fmt;
use std::time::Duration;

use serde_json::{Value, json};

use super::piece::{Log, Ran};

/// The result.
#[derive(Debug)]
pub(crate) struct Soak {
    ran: Vec<Ran>,
    wall_s: f64,
    /// Everything that is wrong, in words.
    wrong: Vec<String>,
}

impl Soak {
    /// Compares the pieces of equal inputs.
    pub(crate) fn of(ran: Vec<Ran>, wall: Duration) -> Self {
        let name = |ran: &Ran| format!("piece {}, log {}", ran.piece.number, ran.piece.log.name());
        let mut wrong: Vec<String> =
            ran.iter().flat_map(|one| one.wrong.iter().map(move |words| format!("{}: {words}", name(one)))).collect();
        for one in &ran {
            let same = ran.iter().find(|other| other.piece.number == one.piece.number);
            if let Some(first) = same.filter(|first| first.pulse_hash != one.pulse_hash) {
                wrong.push(format!(
                    "{}: the hash of its pulses is {}, that of {} with the same inputs is {}",
                    name(one),
                    one.pulse_hash,
                    name(first),
                    first.pulse_hash
                ));
            }
        }
        Self { ran, wall_s: wall.as_secs_f64(), wrong }
    }

    /// Nothing is wrong.
    pub(crate) fn is_sound(&self) -> bool {
        self.wrong.is_empty()
    }

    fn virtual_s(&self) -> f64 {
        self.ran.iter().map(|ran| ran.piece.secs).sum()
    }

    /// Virtual seconds for a second of the processor.
    fn pace(&self) -> Option<f64> {
        let cpu_s = self.ran.iter().map(|ran| ran.cpu_s).sum::<Option<f64>>()?;
        (cpu_s > 0.0).then(|| self.virtual_s() / cpu_s)
    }

    /// One object.
    pub(crate) fn json(&self) -> Value {
        let pieces: Vec<Value> = self
            .ran
            .iter()
            .map(|ran| {
                let [cycles, microseconds] = ran.wraps();
                json!({
                    "piece": ran.piece.number, "log": ran.piece.log.name(), "secs": ran.piece.secs, "watchdog_hz": ran.piece.watchdog_hz(), "frames": ran.frames,
                    "violations": ran.violations, "pulse_hash": ran.pulse_hash, "ticks": ran.ticks.ticks,
                    "missed": ran.ticks.missed, "late": ran.ticks.late, "ticks_in_log": ran.logged.as_ref().map(|log| log.ticks.ticks),
                    "setpoint_hash": ran.logged.as_ref().map(|log| &log.setpoint_hash), "cycle_counter_wraps": cycles,
                    "microsecond_timer_wraps": microseconds, "cpu_s": ran.cpu_s,
                })
            })
            .collect();
        json!({
            "type": "soak", "sound": self.is_sound(), "wrong": self.wrong, "virtual_s": self.virtual_s(), "wall_s": self.wall_s,
            "virtual_s_per_cpu_s": self.pace(), "pieces": pieces,
        })
    }
}

impl fmt::Display for Soak {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "| log | pieces | virtual hours | ticks | missed | late | pulse frames | violations | wraps: cycles, microseconds | pulse hashes |\n\
             |---|---|---|---|---|---|---|---|---|---|"
        )?;
        for log in Log::ALL {
            let of: Vec<&Ran> = self.ran.iter().filter(|ran| ran.piece.log == log).collect();
            let sum = |number: fn(&Ran) -> u64| of.iter().map(|ran| number(ran)).sum::<u64>();
            let hours = of.iter().map(|ran| ran.piece.secs).sum::<f64>() / 3600.0;
            // Equal ones are shown once in the message of what is wrong; here the first digits are enough.
            let hashes: Vec<&str> = of.iter().map(|ran| &ran.pulse_hash[..6]).collect();
            writeln!(
                f,
                "| {} | {} | {hours:.3} | {} | {} | {} | {} | {} | {}, {} | {} |",
                log.name(),
                of.len(),
                sum(|ran| ran.ticks.ticks),
                sum(|ran| ran.ticks.missed),
                sum(|ran| ran.ticks.late),
                sum(|ran| ran.frames),
                sum(|ran| ran.violations),
                sum(|ran| ran.wraps()[0]),
                sum(|ran| ran.wraps()[1]),
                hashes.join(" ")
            )?;
        }
        let pace = self.pace().map_or_else(String::new, |pace| format!(", {pace:.2} virtual s per s of the processor"));
        writeln!(f, "\n{:.0} virtual s in {:.0} s{pace}; {} wrong", self.virtual_s(), self.wall_s, self.wrong.len())?;
        self.wrong.iter().try_for_each(|words| writeln!(f, "wrong: {words}"))
    }
}

#[cfg(test)]
mod tests {
    use super::super::piece::{Logged, Piece, Ticks};
    use super::*;

    fn ran(log: Log, pulse_hash: &str) -> Ran {
        let ticks = Ticks { ticks: 59_990, missed: 0, late: 0 };
        let logged = Logged { ticks, setpoint_hash: "00".into() };
        Ran {
            piece: Piece { number: 0, log, secs: 60.0 },
            frames: 2_700,
            violations: 0,
            pulse_hash: pulse_hash.into(),
            ticks,
            logged: (log == Log::Read).then_some(logged),
            cpu_s: Some(40.0),
            wrong: Vec::new(),
        }
    }

    #[test]
    fn equal_pieces_are_sound_and_another_hash_is_named() {
        let soak = Soak::of(Log::ALL.map(|log| ran(log, "0123456789abcdef")).into(), Duration::from_secs(60));
        let text = soak.to_string();
        assert!(
            soak.is_sound() && text.contains("| read | 1 | 0.017 | 59990 | 0 | 0 | 2700 | 0 | 2, 0 | 012345 |"),
            "{text}"
        );
        assert!(text.contains("| not attached | 1 | 0.017 | 59990 | 0 | 0 | 2700 |"), "{text}");
        assert!(text.contains("180 virtual s in 60 s, 1.50 virtual s per s of the processor; 0 wrong"), "{text}");
        assert_eq!(soak.json()["pieces"][1]["ticks"], 59_990);

        let mut other = Log::ALL.map(|log| ran(log, "0123456789abcdef"));
        other[2].pulse_hash = "fedcba9876543210".into();
        let soak = Soak::of(other.into(), Duration::from_secs(60));
        assert!(!soak.is_sound() && soak.to_string().contains("piece 0, log attached, not read: the hash"), "{soak}");
        assert_eq!(soak.json()["sound"], false);
    }
}
