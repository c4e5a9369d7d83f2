//! Examples for the help text of each command. A test runs every one of them, or names the reason why not.
//!
//! Files in `samples/` are those of the repository; `footfall sample --all -o samples` writes them anywhere.

use clap::Command;

/// An example: what it does, and the command line.
pub type Example = (&'static str, &'static str);

/// The examples of each command, in the order of `footfall --help`.
pub const EXAMPLES: &[(&str, &[Example])] = &[
    (
        "watch",
        &[
            (
                "Ten seconds, as lines of text:",
                "footfall watch --elf firmware.elf --virtual-board virtual-board --secs 10 --plain",
            ),
            (
                "A generator of your own, with every tick recorded (`cargo xtask run` finds image and board):",
                "footfall watch --elf firmware.elf --virtual-board virtual-board --generator generator.toml --record walk.mcap",
            ),
            (
                "A real board, live, through its serial port; the arrow keys change its parameters:",
                "footfall watch --serial /dev/ttyACM0",
            ),
            (
                "A real board through a debug probe, by the RTT server of OpenOCD; the arrow keys change its parameters:",
                "footfall watch --rtt tcp:localhost:9090",
            ),
            (
                "The virtual board, whose parameters the arrow keys change:",
                "footfall watch --elf firmware.elf --virtual-board virtual-board --tune",
            ),
            ("The same in Foxglove, at ws://127.0.0.1:8765:", "footfall watch --serial /dev/ttyACM0 --foxglove"),
            ("The same in PlotJuggler, by UDP:", "footfall watch --serial /dev/ttyACM0 --udp 127.0.0.1:9870"),
        ],
    ),
    (
        "record",
        &[
            (
                "A minute of the virtual board:",
                "footfall record --elf firmware.elf --virtual-board virtual-board --secs 60 -o walk.mcap",
            ),
            (
                "The same with a stated start, so that each run gives the same bytes:",
                "footfall record --elf firmware.elf --virtual-board virtual-board --start-time 1700000000 -o walk.mcap",
            ),
            (
                "A real board through a debug probe, by the RTT server of J-Link:",
                "footfall record --rtt jlink:localhost:19021 -o walk.csv",
            ),
            (
                "A real board without a probe, through its serial port:",
                "footfall record --serial /dev/ttyACM0 -o walk.csv",
            ),
        ],
    ),
    (
        "set",
        &[
            ("What can be set:", "footfall set --list"),
            ("What is set on the board:", "footfall set --serial /dev/ttyACM0 --show"),
            (
                "The speed of a walk, in effect at the next phase boundary:",
                "footfall set --serial /dev/ttyACM0 speed 1.2",
            ),
            ("Back to the settings before, from a script:", "footfall set --serial /dev/ttyACM0 --undo --json"),
        ],
    ),
    (
        "volts",
        &[
            (
                "The left knee of a recording, as the board's converter would read it:",
                "footfall volts --trace samples/walk.csv -o volts.csv",
            ),
            (
                "The same, of the sensor of another table:",
                "footfall volts --trace samples/walk.csv --calibration samples/sensor.toml",
            ),
        ],
    ),
    (
        "check",
        &[
            ("What is read from a recording, and whether `fit` takes it:", "footfall check --trace samples/walk.c3d"),
            (
                "Files of two kinds:",
                "footfall check --generator samples/generator.toml --calibration samples/sensor.toml",
            ),
            (
                "A sensor file for a Nucleo whose supply is never below 3.1 V:",
                "footfall check --calibration samples/sensor.toml --board nucleo-f446re --min-supply 3.1",
            ),
        ],
    ),
    (
        "walk",
        &[
            ("A walk whose cadence rises, as CSV:", "footfall walk --cadence 100..130 --secs 20 --csv"),
            (
                "The angles of a generator file, as a table:",
                "footfall walk --generator samples/generator.toml --secs 20 --csv angles.csv",
            ),
            (
                "A change of gait and a stop, as a picture:",
                "footfall walk --switch \"t=2 run\" --switch \"t=4 stop\" --svg walk.svg",
            ),
        ],
    ),
    (
        "obb",
        &[
            ("The word of a cycle:", "footfall obb --reversibility 1,5"),
            (
                "Two changes of gait, as a picture:",
                "footfall obb --reversibility 1,5 --steps 120 --switch \"54:1,3 100:1,1\" --svg block.svg",
            ),
        ],
    ),
    (
        "figures",
        &[
            ("All pictures, into a folder:", "footfall figures -o figures"),
            ("The same, over those of an earlier run:", "footfall figures -o figures --force"),
        ],
    ),
    (
        "reproduce",
        &[
            ("Everything, in minutes; read index.html:", "footfall reproduce papers"),
            ("A first look, in seconds:", "footfall reproduce papers-quick --quick"),
        ],
    ),
    (
        "gait-error",
        &[("The table:", "footfall gait-error"), ("The same as one JSON object:", "footfall gait-error --json")],
    ),
    (
        "hexapod",
        &[
            ("All live orientations, with their steps:", "footfall hexapod --list"),
            ("From the wave to the tripod:", "footfall hexapod --steps 120 --switch \"54:3 100:1\" --svg legs.svg"),
        ],
    ),
    (
        "smer",
        &[
            ("Whether a graph is live, and its period:", "footfall smer samples/graph.txt"),
            ("Its first steps, and a picture:", "footfall smer samples/graph.txt --steps 20 --svg graph.svg"),
        ],
    ),
    (
        "certify",
        &[
            (
                "A follower: how soon it locks, over which cadences:",
                "footfall certify samples/follower.toml -o certificate.json",
            ),
            ("A gait by its name:", "footfall certify human-walk"),
            ("Every name:", "footfall certify list"),
        ],
    ),
    (
        "phase-response",
        &[
            (
                "A small and a large kick of a neuron's potential:",
                "footfall phase-response oscillator:fitzhugh-nagumo --kick 0.05,0.4 --svg response.svg",
            ),
            (
                "The default walk, kicked at the left knee's velocity, every value as CSV:",
                "footfall phase-response phase-coupled --variable left_knee.velocity -o response.csv",
            ),
        ],
    ),
    (
        "tongue",
        &[
            ("An oscillator, every value as CSV:", "footfall tongue oscillator:van-der-pol -o tongue.csv"),
            (
                "A finer map of the 1:1 range alone:",
                "footfall tongue oscillator:hopf --ratio 0.7..1.3 --strength 0.2 --lock 1:1 --columns 40 --rows 10 --svg tongue.svg",
            ),
        ],
    ),
    (
        "basin",
        &[
            (
                "A neuron that rests or fires, depending on its start:",
                "footfall basin oscillator:morris-lecar --set current=90 --svg basin.svg",
            ),
            (
                "Two neurons of which one wins:",
                "footfall basin oscillator:matsuoka --set weight=4 --x x1=-1..1 --y x2=-1..1 --at v1=0 --at v2=0",
            ),
        ],
    ),
    (
        "bifurcation",
        &[
            (
                "Where a neuron begins to fire:",
                "footfall bifurcation oscillator:fitzhugh-nagumo --parameter current=0.3..0.36 --svg onset.svg",
            ),
            (
                "The default walk with weaker links:",
                "footfall bifurcation phase-coupled --parameter coupling.hips=0..0.5 --points 11 -o links.csv",
            ),
        ],
    ),
    (
        "fit",
        &[
            ("A generator of a recording:", "footfall fit samples/walk.mot -o generator.toml"),
            (
                "A follower for this person, with the sensor on the left hip:",
                "footfall fit samples/walk.csv --follow left_hip -o follower.toml",
            ),
            (
                "Many recordings, two at a time, into the folder fits:",
                "footfall fit samples/walk.csv samples/walk.mot -o fits --jobs 2",
            ),
            (
                "Hips, knees and ankles, for the host:",
                "footfall fit samples/ankles.mot --kind phase-coupled --joints 6 -o six-joints.toml",
            ),
        ],
    ),
    (
        "convert",
        &[
            ("Any recording as CSV:", "footfall convert samples/walk.c3d -o walk.csv"),
            (
                "The volts of a sensor as angles:",
                "footfall convert samples/oscilloscope.csv --map left_knee=CH1 --calibration samples/sensor.toml -o knee.mot",
            ),
        ],
    ),
    (
        "merge",
        &[
            (
                "Two shares of a batch, fitted on different computers:",
                "footfall fit samples/walk.csv samples/walk.mot -o shares --shard 1/2",
            ),
            ("", "footfall fit samples/walk.csv samples/walk.mot -o shares --shard 2/2"),
            ("Their summary, in the folder of the results:", "footfall merge shares"),
        ],
    ),
    (
        "entrain",
        &[
            (
                "How well a follower follows the left hip of a person:",
                "footfall entrain samples/walk.csv --sensor left_hip --svg follow.svg",
            ),
            (
                "The same with the templates of a generator file:",
                "footfall entrain samples/walk.csv --generator samples/follower.toml",
            ),
        ],
    ),
    (
        "calibrate",
        &[
            (
                "From a file of known angles:",
                "footfall calibrate samples/rows.csv -o hip.toml --name \"hip 3\" --report hip.html",
            ),
            (
                "At most eight points, joined by straight lines:",
                "footfall calibrate samples/rows.csv -o knee.toml --points 8 --interpolation linear",
            ),
        ],
    ),
    (
        "trim",
        &[
            (
                "The servo of the left hip, with the default robot's record on the board:",
                "footfall trim left_hip --serial /dev/ttyACM0 --robot robot.toml -o robot.toml --force",
            ),
            (
                "The answers from a file, a line each; someone holds the button:",
                "footfall trim left_knee --serial /dev/ttyACM0 --robot robot.toml -o trimmed.toml < answers.txt",
            ),
        ],
    ),
    (
        "bringup",
        &[
            (
                "A board with a label, step by step (`cargo xtask bringup` reads the number of its chip):",
                "footfall bringup --serial /dev/ttyACM0 --chip-id label-7",
            ),
            (
                "Its clock against that of this computer for ten minutes, into a file of another name:",
                "footfall bringup --serial /dev/ttyACM0 --chip-id label-7 --clock-secs 600 -o label-7.toml",
            ),
        ],
    ),
    (
        "sync",
        &[
            (
                "Edges of a board's synchronisation output, as another system recorded them:",
                "footfall sync samples/edges.csv",
            ),
            (
                "Edges of one line, recorded by both:",
                "footfall sync samples/line-board.csv --against samples/line-recorder.csv",
            ),
        ],
    ),
    (
        "replay",
        &[
            ("A capture of a run:", "footfall replay walk.mcap"),
            ("One in CSV, with what differs as JSON:", "footfall replay walk.csv --json"),
        ],
    ),
    (
        "pack",
        &[
            ("A flash record of a generator:", "footfall pack samples/generator.toml -o generator.bin"),
            ("A generator as a Rust constant:", "footfall pack samples/generator.toml --rust"),
            (
                "A sensor for a Black Pill:",
                "footfall pack --sensor left_hip=samples/sensor.toml --board black-pill-f411 -o sensors.bin",
            ),
        ],
    ),
    (
        "save",
        &[
            (
                "What the board at this port has now:",
                "footfall save samples/generator.toml --serial /dev/ttyACM0 -o tuned.toml",
            ),
            (
                "A faster walk with a smaller left hip, as it was tried on the board:",
                "footfall save samples/generator.toml --set speed=1.2 --set amplitude_left_hip=0.9 -o tuned.toml",
            ),
            (
                "An offset, of a robot with another park pose:",
                "footfall save samples/generator.toml --set offset_left_knee=-2.5 --robot samples/robot.toml -o bent.toml",
            ),
        ],
    ),
    (
        "defaults",
        &[
            ("A robot file:", "footfall defaults robot > robot.toml"),
            ("A sensor file:", "footfall defaults sensor > sensor.toml"),
            ("A walk of eight joints:", "footfall defaults eight-joints > eight-joints.toml"),
        ],
    ),
    (
        "sample",
        &[
            ("One file:", "footfall sample walk.csv -o my-walk.csv"),
            ("All files, into a folder:", "footfall sample --all -o my-samples"),
        ],
    ),
    (
        "completions",
        &[
            ("For bash, which reads it with `source footfall.bash`:", "footfall completions bash > footfall.bash"),
            ("For fish:", "footfall completions fish > footfall.fish"),
        ],
    ),
    ("man", &[("All pages, into a folder:", "footfall man -o man"), ("One page:", "footfall man fit")]),
];

/// The program with the examples below the help of its commands.
#[must_use]
pub fn added(program: Command) -> Command {
    EXAMPLES.iter().fold(program, |program, (name, examples)| {
        // A program without the analysis has fewer commands.
        if program.find_subcommand(name).is_none() {
            return program;
        }
        program.mut_subcommand(name, |command| {
            let header = command.get_styles().get_header();
            let mut help = command.get_after_help().map_or(String::new(), |help| format!("{}\n\n", help.ansi()));
            help += &format!("{header}Examples:{header:#}");
            for (what, line) in *examples {
                help += &if what.is_empty() { format!("\n    {line}") } else { format!("\n  {what}\n    {line}") };
            }
            command.after_help(help)
        })
    })
}
