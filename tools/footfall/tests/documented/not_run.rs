//! Command lines that are not run, and those that do not end with success.

/// Reason, and the lines.
pub(crate) const NOT_RUN: &[(&str, &[&str])] = &[
    (
        "builds the firmware image and the virtual board",
        &[
            "cargo xtask run",
            "cargo xtask run --generator generator.toml",
            "cargo xtask run --shadow --generator follower.toml --sensor left_hip=hip.toml",
            "cargo xtask run --shadow --generator follower.toml --sensor left_hip=hip.toml --trace samples/walk.csv",
            "cargo xtask run --generator follower.toml --sensor left_hip=hip.toml --trace samples/walk.csv",
            "cargo xtask run --sensor left_hip --sensor right_hip --sensor left_knee=knee.toml --sensor right_knee --record walk.mcap",
            "cargo xtask run --secs 10 --disarm --json | tail -1",
            "cargo xtask run --trace samples/walk.csv --record walk.mcap",
            "cargo xtask run --robot robot.toml",
            "cargo xtask run --generator samples/generator.toml --robot robot.toml",
            "cargo xtask run --generator generator.toml --robot robot.toml",
            "cargo xtask run -- --hang control_step@3",
            "cargo xtask bench oscillators",
            "footfall watch --elf firmware.elf --virtual-board virtual-board --secs 10 --plain",
            "footfall watch --elf firmware.elf --virtual-board virtual-board --generator generator.toml --record walk.mcap",
            "footfall record --elf firmware.elf --virtual-board virtual-board --secs 60 -o walk.mcap",
        ],
    ),
    (
        "reads what the virtual board recorded, which needs the image",
        &[
            "cargo footfall fit walk.mcap -o generator.toml",
            "cargo footfall replay walk.mcap",
            "footfall replay walk.mcap",
            "footfall replay walk.csv --json",
        ],
    ),
    (
        "needs a board",
        &[
            "cargo xtask flash",
            "cargo xtask flash --board nucleo-f446re",
            "cargo xtask flash --generator generator.toml",
            "cargo xtask flash --robot robot.toml",
            "cargo xtask flash --generator generator.toml --robot robot.toml",
            "cargo xtask flash --sensor left_hip=hip.toml --sensor left_knee=knee.toml",
            "cargo xtask flash --shadow",
            "cargo xtask flash --dfu",
            "cargo xtask flash --board nucleo-f446re --generator samples/generator.toml --robot robot.toml --shadow",
            "cargo xtask board info --board nucleo-f446re",
            "cargo xtask board info",
            "cargo xtask board read -o saved",
            "cargo xtask board erase --generator",
            "footfall record --elf firmware.elf --rtt tcp:localhost:19021 -o walk.csv",
        ],
    ),
    (
        "installs programs, or uses a compiler of Debian",
        &[
            "cargo xtask setup",
            "cargo install probe-rs-tools --locked",
            "mkdir -p target/tool-links",
            "ln -sf /usr/lib/llvm-22/bin/lld target/tool-links/rust-lld",
            "env -u RUSTUP_TOOLCHAIN PATH=\"$PWD/target/tool-links:$PATH\" RUSTC=/usr/bin/rustc RUSTDOC=/usr/bin/rustdoc RUSTC_BOOTSTRAP=1 CARGO_UNSTABLE_BUILD_STD=core,alloc CARGO_TARGET_DIR=target/thumb-debian /usr/bin/cargo build -p firmware --release --target thumbv7em-none-eabihf",
        ],
    ),
    (
        "runs tests, of which this is one",
        &[
            "cargo xtask test",
            "cargo xtask test --list",
            "cargo xtask test --only image-tests",
            "cargo xtask test --only images --only virtual-board --only image-tests",
            "cargo test -p cpg-core --test entrainment",
            "cargo test -p cpg-core --test rayleigh --test thesis",
            "cargo test -p cpg-core --test smoothness -- --nocapture",
            "cargo test -p footfall --test conventions",
            "cargo test -p footfall --test edge_reversal",
            "cargo test -p footfall --test gait_changes",
            "cargo test -p footfall --test gait_changes -- --nocapture",
            "cargo test -p footfall --test gait_changes -- --ignored --nocapture",
            "cargo test -p footfall-tests --test entrainment",
            "cargo test -p footfall-tests --test fits -- --nocapture",
            "cargo test -p footfall-tests --test recordings -- --nocapture an_hour",
            "cargo test -p footfall-tests --test sensor_faults -- --nocapture",
            "cargo test -p gait-trace",
            "cargo test -p generator-file --test adversarial",
            "cargo test -p generator-file --test certificate",
            "cargo test -p generator-file --test gait_family",
        ],
    ),
    (
        "builds another program, and some of them compute for minutes",
        &[
            "cargo run -p cpg-core --example hello_cpg",
            "cargo run -p footfall --example samples",
            "cargo run -p reproduce --example gait_family",
            "cargo run -p reproduce --example gait_family -- --write",
            "cargo run --profile host -p reproduce --example thesis_mode",
            "cargo run --profile host -p reproduce --example search_speed",
            "cargo doc -p cpg-core --open",
        ],
    ),
    (
        "needs GNU parallel or Slurm, and names a folder of the reader",
        &[
            "parallel --jobs 4 footfall fit recordings/ -o fits --shard {}/4 ::: 1 2 3 4",
            "footfall fit recordings/ -o fits --jobs 2 --shard \"$SLURM_ARRAY_TASK_ID/16\"",
        ],
    ),
    ("FILE stands for any file", &["footfall certify FILE", "footfall check --trace"]),
    ("names a way to work: it asks for angles and waits for codes", &["footfall calibrate --guide"]),
];

/// Lines that end with another exit code, and why.
pub(crate) const FAILS: &[(&str, i32, &str)] =
    &[("cargo footfall certify human-run-unscaled", 1, "it exceeds the limits of the robot, which the page says")];
