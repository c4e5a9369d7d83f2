//! Prototype, not to land.
use cpg_core::{Follow, Generator};
use footfall::command::entrain::entrain;
use footfall::command::entrain::run;
use gait_trace::format::csv_file;
use joint_units::{Joint, Phase, Radians};
use std::io::Write;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    for name in [
        "gaitprint_young_overground",
        "gaitprint_middle_overground",
        "welker_007_run_natural",
        "welker_007_run_exotendon",
    ] {
        let recording = csv_file::read(std::path::Path::new(&format!("{}/{name}.csv", args[1]))).unwrap();
        for sensor in Joint::ALL {
            let e = entrain(&recording, sensor, None).unwrap();
            let mut f = run::follower(e.templates, sensor, e.learned.stride_s).unwrap();
            let mut out = std::io::BufWriter::new(
                std::fs::File::create(format!("{}/{name}_{}.csv", args[2], sensor.name())).unwrap(),
            );
            let start = recording.time_s()[0];
            let (from, to) = e.following.steady_s.unwrap();
            writeln!(out, "# {from} {to} {}", e.learned.stride_s).unwrap();
            for (n, s) in run::samples(&recording, sensor).unwrap().into_iter().enumerate() {
                f.observe(Some(Radians::from_degrees(s as f32)));
                f.step();
                if n % 5 != 0 {
                    continue;
                }
                let t = n as f64 * 1e-3;
                let j: Vec<f64> =
                    Joint::ALL.iter().map(|&j| recording.at(recording.of_joint(j).unwrap(), start + t)).collect();
                let cyc = |p: Phase| f64::from(p.0) / 4294967296.0;
                let l = f.phase_lock();
                writeln!(
                    out,
                    "{t},{},{},{},{},{},{:?},{:?},{},{},{}",
                    cyc(l.phase()),
                    cyc(f.phase()),
                    l.frequency().0,
                    f.amplitude(),
                    e.learned.phase_at(t),
                    j,
                    f.angles().map(|a| a.degrees()),
                    l.innovation().degrees(),
                    l.sensor().0.degrees(),
                    l.sensor().1
                )
                .unwrap();
            }
        }
    }
}
