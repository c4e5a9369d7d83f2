//! Prototype, not to land.
use footfall::command::entrain::entrain;
use gait_trace::format::csv_file;
use joint_units::{Joint, Phase};
use cpg_core::waveform::shape::Shape;
use std::io::Write;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    for name in ["gaitprint_young_overground","gaitprint_middle_overground","welker_007_run_natural","welker_007_run_exotendon"] {
        let recording = csv_file::read(std::path::Path::new(&format!("{}/{name}.csv", args[1]))).unwrap();
        for sensor in Joint::ALL {
            let run = entrain(&recording, sensor, None).unwrap();
            let mut out = std::io::BufWriter::new(std::fs::File::create(format!("{}/{name}_{}.csv", args[2], sensor.name())).unwrap());
            let start = recording.time_s()[0];
            let (from, to) = run.following.steady_s.unwrap();
            writeln!(out, "# {from} {to} {:?} {:?}", run.following.steady_rmse_deg, run.following.perfect_phase_rmse_deg).unwrap();
            for (n, tick) in run.ticks.iter().enumerate().step_by(5) {
                let t = n as f64 * 1e-3;
                let j: Vec<f64> = Joint::ALL.iter().map(|&j| recording.at(recording.of_joint(j).unwrap(), start + t)).collect();
                let est: Vec<f64> = run.templates.iter().map(|x| f64::from(x.at(tick.estimate).angle).to_degrees()).collect();
                let cyc = |p: Phase| f64::from(p.0) / 4294967296.0;
                writeln!(out, "{t},{},{},{},{},{},{:?},{:?},{:?}", cyc(tick.estimate), cyc(tick.phase), tick.frequency, tick.amplitude, run.learned.phase_at(t), j, tick.angles, est).unwrap();
            }
        }
    }
}
