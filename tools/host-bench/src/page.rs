//! The page and the picture of a result.

use anyhow::{Context, Result};
use picture::{Curve, Panel, draw};
use serde_json::Value;
use std::fmt::Write as _;

/// The result, from which the others are made.
pub(crate) const JSON: &str = "docs/host.json";
/// The page.
pub(crate) const PAGE: &str = "docs/host.md";
/// The picture of how each part grows.
pub(crate) const PICTURE: &str = "docs/host-growth.svg";

/// What stands above the numbers.
const HEAD: &str = include_str!("head.txt");

/// The page as Markdown; parts that were not measured are left out.
pub(crate) fn page(result: &Value) -> Result<String> {
    let mut text = HEAD.to_owned();
    let machine = &result["machine"];
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "Measured at commit `{}` on {} (family {}, model {}), {} cores, vectors of {} numbers, with a load of {} processes at the start.",
        word(&machine["commit"]),
        word(&machine["processor"]),
        word(&machine["family"]),
        word(&machine["model"]),
        machine["cores"],
        machine["lanes"],
        machine["load"],
    );
    for (part, machine) in result["again"].as_object().into_iter().flatten() {
        let commit = word(&machine["commit"]);
        let _ = writeln!(
            text,
            "The part `{part}` was measured alone, at commit `{commit}`, with a load of {} processes.",
            machine["load"]
        );
    }
    text += &aims(result)?;
    if result["search"].is_object() {
        text += &search(result)?;
    }
    if let Some(fit) = result["fit"].as_object() {
        let _ = write!(
            text,
            "\n## A whole fit\n\n`footfall fit` of a recording of {} s at 100 Hz, with certificate; the report has all other generators beside it.\n\n\
             | | seconds | of all cores | memory |\n|---|---|---|---|\n",
            fit["recording_s"]
        );
        for (name, key) in [("without a report", "without_report"), ("with a report", "with_report")] {
            let row = &fit[key];
            let _ = writeln!(text, "| {name} | {} | {} | {} |", row["seconds"], row["processor_s"], megabytes(row)?);
        }
        text += "\nAfter each run with a report the same recording is fitted in Python: least squares for one kind of generator, without certificate and report. Its\n\
                 time is without the start of Python, and is divided by that of the run of `footfall fit` just before, as a whole:\n\n\
                 | | seconds | / here |\n|---|---|---|\n";
        let other = &result["fit"]["other"];
        let _ = match other["name"].as_str() {
            Some(name) => writeln!(text, "| {name} | {} | {} |", other["seconds"], other["ratio"]),
            None => writeln!(text, "| Python | not measured: {} | |", word(&other["missing"])),
        };
    }
    if let Some(formats) = result["readers"].as_array() {
        text += "\n## Readers\n\nA process that reads one file from the memory of the system; the largest of four sizes.\n\n\
                 | format | file, MB | rows | MB/s by the clock | MB/s of processor time | memory, MB | memory / file |\n|---|---|---|---|---|---|---|\n";
        for format in formats {
            let size = format["sizes"].as_array().and_then(|sizes| sizes.last()).context("a format without sizes")?;
            let (bytes, peak) = (number(&size["bytes"])?, number(&size["peak_bytes"])?);
            let _ = writeln!(
                text,
                "| {} | {:.0} | {} | {} | {} | {:.0} | {:.2} |",
                word(&format["format"]),
                bytes / 1e6,
                size["rows"],
                size["mb_per_s"],
                size["processor_mb_per_s"],
                peak / 1e6,
                peak / bytes
            );
        }
        text += "\nAfter each of these runs a package of Python reads the same file. Its time is without the start of Python, and is divided by that of the run here just\n\
                 before. The packages give tables of numbers, or messages; here joints, signs and gaps are looked at besides.\n\n\
                 | format | package | MB/s by the clock | its time / here |\n|---|---|---|---|\n";
        for format in formats {
            let size = format["sizes"].as_array().and_then(|sizes| sizes.last()).context("a format without sizes")?;
            let (name, other) = (word(&format["format"]), &format["other"]);
            let _ = match other["name"].as_str() {
                Some(package) => {
                    let speed = number(&size["bytes"])? / 1e6 / number(&other["seconds"])?;
                    writeln!(text, "| {name} | {package} | {speed:.0} | {} |", other["ratio"])
                }
                None => writeln!(text, "| {name} | not measured: {} | | |", word(&other["missing"])),
            };
        }
        text += "\nFiles of CSV, OpenSim, TRC and oscilloscopes above 1 MiB are read in blocks of lines, so their memory is that of what is read, 8 bytes a number,\n\
                 and some megabytes: of each row the time and the angles, of oscilloscopes also the volts, of TRC also the places of the markers and what is computed of them.\n\
                 Held whole while it is read is a file of CSV, OpenSim or an oscilloscope with fewer than 1001 lines in its first MiB, not counting blank ones and\n\
                 comments, one whose lines end in CR, and every file of another format.\n";
    }
    if let Some(counts) = result["folder"]["counts"].as_array() {
        let _ = write!(
            text,
            "\n## Folders of recordings\n\n`fit` of folders with recordings of {} s at 100 Hz, one run of each.\n\n\
             | recordings | seconds | of all cores | ms of processor time a recording | memory |\n|---|---|---|---|---|\n",
            result["folder"]["recording_s"]
        );
        for row in counts {
            let each = 1e3 * number(&row["processor_s"])? / number(&row["recordings"])?;
            let _ = writeln!(
                text,
                "| {} | {} | {} | {each:.0} | {} |",
                row["recordings"],
                row["seconds"],
                row["processor_s"],
                megabytes(row)?
            );
        }
    }
    if result["readers"].is_array() {
        text += "\n## How each grows\n\n![Time and peak memory of the readers over the size of the file, and of a folder over the number of recordings](host-growth.svg)\n";
    }
    Ok(text)
}

/// What is aimed at, and what was measured; a part that was not measured has no row.
fn aims(result: &Value) -> Result<String> {
    let mut text = String::from(
        "\n## Aims\n\nTimes are by the clock, beside the other work of the machine; processor time is of all cores.\n\n| | aim | measured | |\n|---|---|---|---|\n",
    );
    let mut row = |what: &str, aim: String, measured: String, is_met: bool| {
        text += &format!("| {what} | {aim} | {measured} | {} |\n", if is_met { "met" } else { "missed" });
    };
    let search = &result["search"];
    for kernel in search["kernel"].as_array().map_or(&[][..], Vec::as_slice) {
        let ratio = number(&kernel["to_floor"])?;
        let what = format!("kernel of the search at {} ms, over the floor", kernel["step_ms"]);
        row(&what, format!("{KERNEL_TO_FLOOR}"), format!("{ratio:.2}"), ratio <= KERNEL_TO_FLOOR);
    }
    let rows = |name: &str| search[name].as_array().map_or(&[][..], Vec::as_slice);
    let searches = rows("search");
    for (step_ms, seconds) in SEARCH_S {
        let Some(found) = searches.iter().find(|row| row["step_ms"] == step_ms && row["threads"] == 2) else {
            continue;
        };
        let (clock, own) = (number(&found["seconds"])?, number(&found["own_s"])?);
        let simulated = number(&found["simulated"])?;
        let what = format!("search at {step_ms} ms on two cores, which simulates {simulated} of its individuals");
        row(&what, format!("{seconds} s"), format!("{clock} s"), clock <= seconds);
        let each = rows("each_simulated").iter().find(|row| row["step_ms"] == step_ms && row["threads"] == 2);
        let each = each.context("no individuals that are all simulated")?;
        let (each, processor) = (number(&each["seconds"])?, number(&each["processor_s"])?);
        let floor = number(&search["floor_ns"])? * 5.0 / step_ms as f64 / 20.0;
        let what = format!(
            "a search that simulated all of them, at {step_ms} ms on two cores, of which the floor is {floor:.2} s"
        );
        row(&what, format!("{seconds} s"), format!("{each} s; {processor} s of processor time"), each <= seconds);
        let percent = 100.0 * own / (own + each);
        let what = format!(
            "own share of the genetic algorithm at {step_ms} ms on two cores, if each individual were simulated"
        );
        row(&what, format!("{OWN_PERCENT} %"), format!("{percent:.1} %; {:.1} ms", own * 1e3), percent < OWN_PERCENT);
    }
    let fit = &result["fit"]["with_report"];
    if let Some(seconds) = fit["seconds"].as_f64() {
        let measured = format!("{seconds} s; {} s of processor time", number(&fit["processor_s"])?);
        row("a fit of 50 s with certificate and report", format!("{FIT_S} s"), measured, seconds < FIT_S);
    }
    for format in result["readers"].as_array().map_or(&[][..], Vec::as_slice) {
        let Some(size) = format["sizes"].as_array().and_then(|sizes| sizes.last()) else { continue };
        let (clock, processor) = (number(&size["mb_per_s"])?, number(&size["processor_mb_per_s"])?);
        let what = format!("reader of {}", word(&format["format"]));
        let measured = format!("{clock:.0} MB/s; {processor:.0} a second of processor time");
        row(&what, format!("{READ_MB_PER_S} MB/s"), measured, clock >= READ_MB_PER_S);
    }
    if let Some([first, .., last]) = result["folder"]["counts"].as_array().map(Vec::as_slice) {
        let growth = number(&last["peak_bytes"])? / number(&first["peak_bytes"])?;
        let what =
            format!("memory of a folder of {} recordings, over that of {}", last["recordings"], first["recordings"]);
        row(&what, format!("{FOLDER_GROWTH}"), format!("{growth:.2}"), growth <= FOLDER_GROWTH);
    }
    Ok(text)
}

/// Largest ratio of the kernel to the floor.
const KERNEL_TO_FLOOR: f64 = 1.18;
/// Step in milliseconds, and longest time of the search on two cores, seconds.
const SEARCH_S: [(u64, f64); 2] = [(1, 0.6), (5, 0.13)];
/// Largest share of the genetic algorithm itself, percent.
const OWN_PERCENT: f64 = 5.0;
/// Longest time of a whole fit, seconds.
const FIT_S: f64 = 1.0;
/// Least speed of a reader.
const READ_MB_PER_S: f64 = 200.0;
/// Largest ratio of the memory of a large folder to that of a small one, which counts as flat.
const FOLDER_GROWTH: f64 = 1.5;

/// The search, and other programs.
fn search(result: &Value) -> Result<String> {
    let search = &result["search"];
    let floor = number(&search["floor_ns"])?;
    let mut text = String::from(
        "\n## The thesis' search\n\n5 s of the four-joint network for each individual, Runge-Kutta. 100,000 individuals are 98 different ones again and again, the new ones of a \
         generation;\na vector holds four of them, and the vectors are full to 98 % on one core and to 94 % on two.\n\n\
         | | ns a network step and core | / floor | seconds | processor time, s | cores busy |\n|---|---|---|---|---|---|\n",
    );
    let _ = writeln!(text, "| floor | {floor} | 1 | | | |");
    for kernel in search["kernel"].as_array().context("no kernel")? {
        let _ = writeln!(
            text,
            "| kernel, {} ms, one core | {} | {:.2} | | | |",
            kernel["step_ms"],
            kernel["ns"],
            number(&kernel["to_floor"])?
        );
    }
    for row in search["each_simulated"].as_array().context("no individuals that are all simulated")? {
        let ns = number(&row["ns"])?;
        let _ = writeln!(
            text,
            "| 100,000 individuals, {} ms, threads: {} | {ns} | {:.2} | {} | {} | {:.2} |",
            row["step_ms"],
            row["threads"],
            ns / floor,
            row["seconds"],
            row["processor_s"],
            number(&row["cores_busy"])?
        );
    }
    let plain = number(&search["plain_f64_ns"])?;
    let _ = writeln!(text, "| a plain loop in f64, 1 ms | {plain} | {:.1} | {:.1} | | |", plain / floor, plain * 0.5);
    text += "\nThe thesis' genetic algorithm, 1000 generations. Crossover makes no new gene, and few individuals are mutated, so most equal a parent: they have \
             its cost and\nare not simulated. *Own time*: of the genetic algorithm itself, without the evaluations; its share is that of this search, of which so little is left to \
             simulate.\n\n\
             | | individuals | simulated | seconds | own time, s | own share |\n|---|---|---|---|---|---|\n";
    for row in search["search"].as_array().context("no search")? {
        let _ = writeln!(
            text,
            "| search, {} ms, threads: {} | {} | {} | {} | {} | {:.0} % |",
            row["step_ms"],
            row["threads"],
            row["evaluations"],
            row["simulated"],
            row["seconds"],
            row["own_s"],
            100.0 * number(&row["own_s"])? / number(&row["seconds"])?
        );
    }
    let Some(peers) = result["peers"].as_array().filter(|peers| !peers.is_empty()) else { return Ok(text) };
    text += "\nOther programs, the simulation of one individual on one core, with its time divided by that on one core here just before, at the same step (at \
             1 ms\nwhere a program chooses its steps). Five runs in turns. Octave gives the median of ten individuals, and in its genetic algorithm the mean of\n\
             the evaluations with the algorithm's own time; SciPy and Numba give the median of 5 and 30 simulations of one. Ours is the mean of 50 generations of 98\n\
             individuals, four in a vector:\n\n\
             | | ms an individual | / here |\n|---|---|---|\n";
    for peer in peers {
        match peer["seconds"].as_f64() {
            Some(seconds) => {
                let _ = writeln!(
                    text,
                    "| {} | {:.3} | {:.0} |",
                    word(&peer["name"]),
                    seconds * 1e3,
                    number(&peer["ratio"])?
                );
            }
            None => {
                let _ = writeln!(text, "| {} | not measured: {} | |", word(&peer["name"]), word(&peer["missing"]));
            }
        }
    }
    Ok(text)
}

/// Time and memory over the size of what is read, and over the number of recordings.
pub(crate) fn picture(result: &Value) -> Result<String> {
    let mut panels = Vec::new();
    if let Some(formats) = result["readers"].as_array() {
        let curves = |of: &dyn Fn(&Value) -> Option<f64>| -> Vec<Curve> {
            let curve = |format: &Value| {
                let sizes = format["sizes"].as_array().map_or(&[][..], Vec::as_slice);
                let point = |size: &Value| Some((size["bytes"].as_f64()? / 1e6, of(size)?));
                let name = word(&format["format"]);
                let name = name.split([',', ' ']).next().unwrap_or_default();
                Curve::new(name, sizes.iter().filter_map(point).collect())
            };
            formats.iter().map(curve).collect()
        };
        let seconds = curves(&|size| size["seconds"].as_f64());
        let memory = curves(&|size| Some(size["peak_bytes"].as_f64()? / 1e6));
        panels.push(Panel::curves("reading a file: time", "size, MB", "time, s", seconds));
        panels.push(Panel::curves("reading a file: peak memory", "size, MB", "memory, MB", memory));
    }
    if let Some(counts) = result["folder"]["counts"].as_array() {
        let curve = |name: &str, of: &dyn Fn(&Value) -> Option<f64>| {
            let point = |row: &Value| Some((row["recordings"].as_f64()?, of(row)?));
            vec![Curve::new(name, counts.iter().filter_map(point).collect())]
        };
        let seconds = curve("clock", &|row| row["seconds"].as_f64());
        let memory = curve("memory", &|row| Some(row["peak_bytes"].as_f64()? / 1e6));
        panels.push(Panel::curves("fitting a folder: time", "recordings", "time, s", seconds));
        // From 0, or a curve that is flat looks as if it grew.
        let from_zero = Curve::new("", vec![(0.0, 0.0)]);
        let memory = [memory, vec![from_zero]].concat();
        panels.push(Panel::curves("fitting a folder: peak memory", "recordings", "memory, MB", memory));
    }
    draw("How the programs for the host grow", &panels, 2).map_err(anyhow::Error::msg)
}

fn number(value: &Value) -> Result<f64> {
    value.as_f64().context("a number is missing")
}

fn word(value: &Value) -> &str {
    value.as_str().unwrap_or("unknown")
}

fn megabytes(row: &Value) -> Result<String> {
    Ok(format!("{:.0} MB", number(&row["peak_bytes"])? / 1e6))
}
