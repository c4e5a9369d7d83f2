//! Comparison of the tables with independent data: `stm32f407vg.txt` and `stm32f411ce.txt`, which embassy-rs/stm32-data took from ST's database.

use std::collections::HashSet;

use stm32f4_model::{AdcChannel, DmaMemory, LintKind, SocConfig, Width};

use crate::bench::*;

/// A chip with the data about it.
struct Oracle {
    config: fn() -> SocConfig,
    data: &'static str,
    /// Enables of the blocks that are listed, in AHB1ENR, APB1ENR, APB2ENR.
    clocked: [u32; 3],
}

const ORACLES: [Oracle; 2] = [
    Oracle {
        config: SocConfig::default,
        data: include_str!("stm32f407vg.txt"),
        clocked: [0x0060_01FF, 0x1000_01FF, 0x0007_4703],
    },
    Oracle {
        config: SocConfig::black_pill,
        data: include_str!("stm32f411ce.txt"),
        clocked: [0x0060_009F, 0x1000_000F, 0x0007_4101],
    },
];

impl Oracle {
    /// Lines of one kind, split at spaces.
    fn lines(&self, kind: &str) -> Vec<Vec<&'static str>> {
        let all = self.data.lines().map(|line| line.split(' ').collect::<Vec<_>>());
        all.filter(|words| words[0] == kind).collect()
    }

    fn base(&self, name: &str) -> u32 {
        let line = self.lines("enable").into_iter().find(|line| line[1] == name);
        let line = line.unwrap_or_else(|| panic!("no {name}"));
        u32::from_str_radix(line[2], 16).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn bench(&self) -> Bench {
        Bench::with((self.config)())
    }

    /// A bench with all blocks clocked.
    fn all_clocked(&self) -> Bench {
        let mut bench = self.bench();
        for (register, bits) in [AHB1ENR, APB1ENR, APB2ENR].into_iter().zip(self.clocked) {
            bench.set(register, bits);
        }
        bench
    }

    /// Whether the chip has a timer or another block.
    fn has(&self, name: &str) -> bool {
        self.lines("enable").iter().any(|line| line[1] == name)
    }
}

fn number(text: &str) -> u32 {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn register(name: &str) -> u32 {
    RCC + match name {
        "AHB1ENR" => 0x30,
        "APB1ENR" => 0x40,
        "APB2ENR" => 0x44,
        "AHB1RSTR" => 0x10,
        "APB1RSTR" => 0x20,
        "APB2RSTR" => 0x24,
        _ => panic!("{name}"),
    }
}

#[test]
fn enable_bits() {
    for oracle in &ORACLES {
        for line in oracle.lines("enable") {
            let (name, base) = (line[1], oracle.base(line[1]));
            let (enable, bit) = (register(line[3]), number(line[4]));
            for on in 0..32 {
                let mut bench = oracle.bench();
                bench.set(enable, 1 << on);
                let before = bench.soc.lints().len();
                bench.get(base);
                let answered = bench.soc.lints().len() == before;
                assert_eq!(answered, on == bit, "{name}, bit {on}");
            }
        }
    }
}

#[test]
fn reset_bits() {
    for oracle in &ORACLES {
        for line in oracle.lines("reset") {
            let (name, base) = (line[1], oracle.base(line[1]));
            let (reset, bit) = (register(line[3]), number(line[4]));
            // A register that keeps what is written, and a value other than its reset value.
            let (probe, value) = match name {
                _ if name.starts_with("TIM") => (base + 0x28, 0x1234),
                _ if name.starts_with("ADC") => (base + 0x10, 0x3),
                _ if name.starts_with("DMA") => (base + 0x18, 0x1234),
                _ if name.starts_with("GPIO") => (base + 0x14, 0x1234),
                "SYSCFG" => (base + 0x08, 0x21),
                _ => (base, 0x4100),
            };
            for on in 0..32 {
                let mut bench = oracle.all_clocked();
                bench.set(probe, value);
                bench.set(reset, 1 << on);
                let held = bench.get(probe);
                bench.set(reset, 0);
                let after = bench.get(probe);
                assert_eq!((held == value, after == value), (on != bit, on != bit), "{name}, bit {on}");
                let in_reset = bench.soc.lints().iter().any(|lint| lint.kind == LintKind::InReset);
                assert_eq!(in_reset, on == bit, "{name}, bit {on}");
            }
        }
    }
}

#[test]
fn every_timer_counts_to_its_width() {
    for oracle in &ORACLES {
        // 17.2, 18.2, 19.2, 20.2: TIM2 and TIM5 have 32 bits, the others 16.
        for line in oracle.lines("enable").iter().filter(|line| line[1].starts_with("TIM")) {
            let top = if matches!(line[1], "TIM2" | "TIM5") { u32::MAX } else { 0xFFFF };
            let mut bench = oracle.all_clocked();
            let base = oracle.base(line[1]);
            assert_eq!(bench.get(base + ARR), top, "{}", line[1]);
            bench.set(base + CR1, 1);
            bench.set(base + CNT, top);
            bench.pass(1);
            assert_eq!((bench.get(base + CNT), bench.get(base + SR) & 1), (0, 1), "{}", line[1]);
        }
    }
}

#[test]
fn interrupt_numbers_of_timers() {
    for oracle in &ORACLES {
        for line in oracle.lines("irq").iter().filter(|line| line[1].starts_with("TIM")) {
            let (timer, wanted) = (&line[1][3..], number(line[3]));
            let flag = match line[2] {
                "UP" => 1,
                "CC" => 1 << 1,
                "COM" => 1 << 5,
                "TRG" => 1 << 6,
                _ => 1 << 7,
            };
            let mut bench = oracle.all_clocked();
            let base = oracle.base(line[1]);
            bench.set(base + EGR, flag);
            bench.set(base + DIER, flag);
            let raised: Vec<u32> = (0..96).filter(|&irq| bench.irq(irq)).collect();
            let exists = match (timer, line[2]) {
                (_, "UP") => true,
                ("6" | "7", _) => false,
                ("1" | "8", _) => true,
                (_, "BRK" | "COM") => false,
                ("10" | "11" | "13" | "14", "TRG") => false,
                _ => true,
            };
            assert_eq!(raised, if exists { vec![wanted] } else { vec![] }, "TIM{timer} {}", line[2]);
        }
    }
}

#[test]
fn interrupt_numbers_of_dma_streams() {
    for oracle in &ORACLES {
        for line in oracle.lines("irq").iter().filter(|line| line[1].starts_with("DMA")) {
            let (base, stream) = (oracle.base(line[1]), number(line[2]));
            let mut bench = oracle.all_clocked();
            let control = base + 0x10 + 0x18 * stream;
            bench.set(control + 4, 1);
            bench.set(control, 1 | 1 << 4);
            // 10.3.14: switching off early raises TCIF.
            bench.set(control, 1 << 4);
            let raised: Vec<u32> = (0..96).filter(|&irq| bench.irq(irq)).collect();
            assert_eq!(raised, [number(line[3])], "{} stream {stream}", line[1]);
            let (clear, place) = (base + 8 + stream / 4 * 4, [0, 6, 16, 22][stream as usize % 4]);
            assert_eq!(bench.get(base + stream / 4 * 4), 1 << (5 + place));
            bench.set(clear, !(1 << (5 + place)));
            assert_eq!(bench.get(base + stream / 4 * 4), 1 << (5 + place));
            bench.set(clear, 1 << (5 + place));
            assert_eq!(bench.get(base + stream / 4 * 4), 0);
        }
    }
}

#[test]
fn timer_outputs_and_their_pins() {
    for oracle in &ORACLES {
        let listed = oracle.lines("pin");
        let names: HashSet<&str> = listed.iter().map(|line| line[3]).collect();
        let outputs: Vec<_> = listed.iter().filter(|line| line[2] != "BKIN").collect();
        let mut signals: Vec<(&str, &str)> = outputs.iter().map(|line| (line[1], line[2])).collect();
        signals.dedup();
        for (timer, signal) in signals {
            let mut bench = oracle.all_clocked();
            for port in 0..5 {
                // The pull-ups of the debug pins would keep a pin high that a timer does not drive.
                bench.set(GPIOA + 0x400 * port + 0x0C, 0);
            }
            let base = oracle.base(timer);
            let channel = number(&signal[2..3]) - 1;
            let complementary = signal.ends_with('N');
            // Forced active, or for OCxN alone the same.
            bench.set(base + CCMR1 + channel / 2 * 4, 0x50 << (channel % 2 * 8));
            bench.set(base + CCER, (if complementary { 4 } else { 1 }) << (channel * 4));
            if matches!(timer, "TIM1" | "TIM8") {
                bench.set(base + BDTR, 1 << 15);
            }
            for name in &names {
                for af in [0, 1, 2, 3, 4, 8, 9, 15] {
                    bench.function(name, 2, af);
                    let wanted = outputs.iter().any(|line| line[1..] == [timer, signal, name, &af.to_string()]);
                    assert_eq!(bench.soc.output_level(pin(name)), wanted, "{timer} {signal} on {name} with AF{af}");
                }
                bench.function(name, 0, 0);
            }
        }
    }
}

#[test]
fn break_inputs_and_their_pins() {
    for oracle in &ORACLES {
        let listed = oracle.lines("pin");
        for (timer, base) in [("TIM1", TIM1), ("TIM8", 0x4001_0400)].into_iter().filter(|(timer, _)| oracle.has(timer))
        {
            // A package has some of these pins.
            let in_package = |name: &&str| listed.iter().any(|line| line[3] == *name);
            for name in ["PA6", "PB12", "PE15", "PA7", "PB13"].into_iter().filter(in_package) {
                for af in 0..16 {
                    let mut bench = oracle.all_clocked();
                    bench.plant.inputs = vec![(0.0, pin(name), true)];
                    bench.function(name, 2, af);
                    bench.set(base + BDTR, 1 << 15 | 1 << 13 | 1 << 12);
                    bench.to(0);
                    let broken = bench.get(base + SR) & 1 << 7 != 0;
                    let wanted = listed.iter().any(|line| line[1..] == [timer, "BKIN", name, &af.to_string()]);
                    assert_eq!(broken, wanted, "{timer} BKIN on {name} with AF{af}");
                }
            }
        }
    }
}

#[test]
fn dma_requests() {
    for oracle in &ORACLES {
        let listed = oracle.lines("dma");
        let mut sources: Vec<(&str, &str)> = listed.iter().map(|line| (line[1], line[2])).collect();
        sources.sort_unstable();
        sources.dedup();
        for (block, signal) in sources {
            let mut bench = oracle.all_clocked();
            let source = oracle.base(block);
            for (controller, stream, channel) in (0..128).map(|n| (1 + n / 64, n / 8 % 8, n % 8)) {
                let dma = oracle.base(&format!("DMA{controller}"));
                let control = dma + 0x10 + 0x18 * stream;
                bench.set(dma + 8, u32::MAX);
                bench.set(dma + 12, u32::MAX);
                bench.set(control + 4, 9);
                bench.set(control + 8, if signal == "DR" { source + 0x4C } else { GPIOB + 0x20 });
                bench.set(control + 12, 0x2000_0000);
                bench.set(control, channel << 25 | 1);
                match signal {
                    "DR" => {
                        bench.set(source, 0);
                        bench.set(source + 8, 1);
                        bench.set(source + 8, 1 | 1 << 8 | 1 << 30);
                    }
                    "UP" => {
                        bench.set(source + DIER, 1 << 8);
                        bench.set(source + EGR, 1);
                    }
                    _ => {
                        let compare = number(&signal[2..]);
                        bench.set(source + DIER, 1 << (8 + compare));
                        bench.set(source + EGR, 1 << compare);
                    }
                }
                bench.pass(100);
                let words = [controller, stream, channel].map(|n| n.to_string());
                let wanted = listed.iter().any(|line| line[1..3] == [block, signal] && line[3..] == words);
                assert_eq!(bench.get(control + 4) == 8, wanted, "{block} {signal}: DMA{controller} {stream} {channel}");
                bench.set(control, 0);
            }
        }
    }
}

#[test]
fn adc_inputs() {
    for oracle in &ORACLES {
        for line in oracle.lines("input") {
            let channel = AdcChannel { adc: number(&line[1][3..]) as u8, channel: number(line[2]) as u8 };
            assert_eq!(channel.pin(), Some(pin(line[3])), "{channel}");
        }
    }
}

#[test]
fn the_ram_of_the_bench_accepts_writes() {
    // The test of the requests counts transfers; a RAM that refused them would hide an error.
    let mut bench = ORACLES[0].all_clocked();
    assert!(bench.ram.write(0x2000_0000, Width::Byte, 1));
    assert_eq!(bench.ram.read(0x2000_0000, Width::Byte), Some(1));
}
