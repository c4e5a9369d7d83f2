//! What must hold for any program: agreement with a timer stepped clock by clock, independence of how time is cut into advances, and
//! no change between events.

use proptest::prelude::*;
use stm32f4_model::{Conversion, Pin};

use crate::bench::*;
use crate::naive::Naive;

/// One write to TIM1, or time that passes.
#[derive(Debug, Clone)]
enum Act {
    Pass(u64),
    Psc(u32),
    Arr(u32),
    Rcr(u32),
    Cnt(u32),
    Ccr(usize, u32),
    Modes(usize, u32, bool, u32, bool),
    Control(u32),
    Generate,
    ClearFlags(u32),
    Interrupts(u32),
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        4 => (0u64..400).prop_map(Act::Pass),
        1 => (0u64..30_000).prop_map(Act::Pass),
        1 => (0u32..6).prop_map(Act::Psc),
        1 => (0u32..60).prop_map(Act::Arr),
        1 => (0u32..4).prop_map(Act::Rcr),
        1 => (0u32..70).prop_map(Act::Cnt),
        3 => (0usize..4, 0u32..65).prop_map(|(channel, value)| Act::Ccr(channel, value)),
        2 => (0usize..2, 0u32..8, any::<bool>(), 0u32..8, any::<bool>()).prop_map(|(w, a, p, b, q)| Act::Modes(w, a, p, b, q)),
        2 => (0u32..16, any::<bool>()).prop_map(|(low, arpe)| Act::Control(low | u32::from(arpe) << 7)),
        1 => Just(Act::Generate),
        1 => (0u32..32).prop_map(Act::ClearFlags),
        1 => (0u32..32).prop_map(Act::Interrupts),
    ]
}

const OUTPUTS: [&str; 4] = ["PA8", "PA9", "PA10", "PA11"];

/// TIM1 with all four channels on their pins, 16 MHz.
fn tim1(watched: bool) -> Bench {
    let mut bench = Bench::clocked();
    if watched {
        for name in OUTPUTS {
            bench.function(name, 2, 1);
        }
    }
    bench.set(TIM1 + CCER, 0x1111);
    bench.set(TIM1 + BDTR, 1 << 15);
    bench
}

/// Does an act to the model, and to the naive timer where there is one.
fn perform(bench: &mut Bench, act: &Act, step: u64) {
    match *act {
        Act::Pass(cycles) => {
            let target = bench.soc.now() + cycles;
            while bench.soc.now() < target {
                bench.to((bench.soc.now() + step).min(target));
            }
        }
        Act::Psc(value) => bench.set(TIM1 + PSC, value),
        Act::Arr(value) => bench.set(TIM1 + ARR, value),
        Act::Rcr(value) => bench.set(TIM1 + RCR, value),
        Act::Cnt(value) => bench.set(TIM1 + CNT, value),
        Act::Ccr(channel, value) => bench.set(TIM1 + CCR1 + 4 * channel as u32, value),
        Act::Modes(which, a, p, b, q) => {
            let value = a << 4 | u32::from(p) << 3 | b << 12 | u32::from(q) << 11;
            bench.set(TIM1 + CCMR1 + 4 * which as u32, value);
        }
        Act::Control(value) => bench.set(TIM1 + CR1, value),
        Act::Generate => bench.set(TIM1 + EGR, 1),
        Act::ClearFlags(flags) => bench.set(TIM1 + SR, !flags),
        Act::Interrupts(enables) => bench.set(TIM1 + DIER, enables),
    }
}

fn perform_naively(naive: &mut Naive, act: &Act) {
    match *act {
        Act::Pass(cycles) => (0..cycles).for_each(|_| naive.clock()),
        Act::Psc(value) => naive.psc = value,
        Act::Arr(value) => naive.arr = value,
        Act::Rcr(value) => naive.rcr = value,
        Act::Cnt(value) => naive.cnt = value,
        Act::Ccr(channel, value) => naive.ccr[channel] = value,
        Act::Modes(which, a, p, b, q) => {
            (naive.modes[2 * which], naive.preload[2 * which]) = (a, p);
            (naive.modes[2 * which + 1], naive.preload[2 * which + 1]) = (b, q);
        }
        Act::Control(value) => {
            naive.enabled = value & 1 != 0;
            naive.udis = value & 2 != 0;
            naive.urs = value & 4 != 0;
            naive.opm = value & 8 != 0;
            naive.arpe = value & 0x80 != 0;
        }
        Act::Generate => naive.generate(),
        Act::ClearFlags(flags) => naive.flags &= !flags,
        Act::Interrupts(_) => {}
    }
    if !matches!(act, Act::Pass(_)) {
        naive.written();
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// 17.3, 17.4: count, flags and reference levels as by the plain stepping of every clock; with and without listeners, as a timer
    /// without listeners takes the short way over whole periods.
    #[test]
    fn agrees_with_a_timer_stepped_clock_by_clock(acts in prop::collection::vec(act(), 1..40), watched: bool) {
        let mut bench = tim1(watched);
        let mut naive = Naive::new();
        for act in &acts {
            perform(&mut bench, act, u64::MAX / 2);
            perform_naively(&mut naive, act);
            prop_assert_eq!(bench.get(TIM1 + CNT), naive.cnt, "count after {:?}", act);
            prop_assert_eq!(bench.get(TIM1 + SR), naive.flags, "flags after {:?}", act);
            prop_assert_eq!(bench.get(TIM1 + CR1) & 1 != 0, naive.enabled);
            if watched {
                let levels = OUTPUTS.map(|name| bench.soc.output_level(pin(name)));
                prop_assert_eq!(levels, naive.reference, "levels after {:?}", act);
            }
        }
    }

    /// Edges come at the very clock at which the plain timer makes them.
    #[test]
    fn edges_come_at_their_clock(acts in prop::collection::vec(act(), 1..20)) {
        let mut bench = tim1(true);
        bench.to(0);
        bench.world.edges.clear();
        let mut naive = Naive::new();
        let (mut wanted, mut now): (Vec<(Pin, bool, f64)>, u64) = (Vec::new(), 0);
        for act in &acts {
            let clocks = if let Act::Pass(cycles) = act { *cycles } else { 1 };
            for _ in 0..clocks {
                let before = naive.reference;
                if let Act::Pass(_) = act {
                    naive.clock();
                    now += 1;
                } else {
                    perform_naively(&mut naive, act);
                }
                for (channel, name) in OUTPUTS.iter().enumerate() {
                    if naive.reference[channel] != before[channel] {
                        wanted.push((pin(name), naive.reference[channel], now as f64 / 16e6));
                    }
                }
            }
            perform(&mut bench, act, u64::MAX / 2);
        }
        bench.pass(0);
        let mut got = bench.world.edges.clone();
        // Edges of one cycle have no order among themselves.
        got.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.0.cmp(&b.0)));
        wanted.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.0.cmp(&b.0)));
        prop_assert_eq!(got, wanted);
    }
}

/// The board's arrangement with odd periods: four servos, a paced injected group, a continuous regular group with DMA, a time base, the
/// watchdog, inputs. What happened, as a record that must not depend on how time is cut.
fn arrangement(periods: (u32, u32, u32), smp: u32) -> Bench {
    let mut bench = tim1(true);
    bench.world.volts = Box::new(|channel, seconds| f64::from(channel.channel) * 0.2 + (seconds * 400.0).sin());
    bench.world.inputs = (1..40).map(|n| (f64::from(n) * 13.7e-6, pin("PA0"), n % 2 == 1)).collect();
    bench.set(TIM1 + ARR, periods.0);
    for channel in 0..4 {
        bench.set(TIM1 + CCR1 + 4 * channel, periods.0 * (channel + 1) / 6);
    }
    bench.set(TIM1 + CCMR1, 0x6868);
    bench.set(TIM1 + CCMR2, 0x7868);
    bench.set(TIM1 + EGR, 1);
    bench.set(TIM1 + CR1, 0x81);
    bench.set(TIM2 + ARR, periods.1);
    bench.set(TIM2 + CR2, 2 << 4);
    bench.set(TIM2 + CR1, 1);
    bench.set(TIM5 + PSC, 3);
    bench.set(TIM5 + ARR, periods.2);
    bench.set(TIM5 + DIER, 3);
    bench.set(TIM5 + CCR1, periods.2 / 3);
    bench.set(TIM5 + EGR, 1);
    bench.set(TIM5 + CR1, 1);
    bench.set(EXTI, 1);
    bench.set(EXTI + 8, 1);
    bench.set(DMA2 + 0x14, 5);
    bench.set(DMA2 + 0x18, ADC1 + 0x4C);
    bench.set(DMA2 + 0x1C, 0x2000_0000);
    bench.set(DMA2 + 0x10, 1 << 13 | 1 << 11 | 1 << 10 | 1 << 8 | 1 << 4 | 1);
    bench.set(ADC1 + 0x10, smp | smp << 9);
    bench.set(ADC1 + 0x34, 3 | 4 << 5);
    bench.set(ADC1 + 0x2C, 1 << 20);
    bench.set(ADC1 + 0x38, 1 << 20 | 1 << 10 | 2 << 15);
    bench.set(ADC1 + 0x04, 1 << 8 | 1 << 7);
    bench.set(ADC1 + 0x08, 1 | 2 | 1 << 8 | 1 << 9 | 3 << 16 | 1 << 20 | 1 << 30);
    bench
}

type Record = (Vec<(Pin, bool, f64)>, Vec<Conversion>, Vec<(u32, f64)>, Vec<u8>, Vec<u32>);

fn record(bench: &mut Bench) -> Record {
    let registers =
        [TIM1 + CNT, TIM2 + CNT, TIM5 + SR, ADC1, ADC1 + 0x3C, DMA2, DMA2 + 0x14, EXTI + 0x14, GPIOA + 0x10];
    (
        std::mem::take(&mut bench.world.edges),
        bench.soc.conversions().collect(),
        bench.world.sampled.iter().map(|&(channel, at)| (u32::from(channel.channel), at)).collect(),
        bench.ram.0[..16].to_vec(),
        registers.iter().map(|&register| bench.get(register)).collect(),
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// One long advance or many short ones: the same history.
    #[test]
    fn history_does_not_depend_on_the_advances(
        periods in (50u32..3000, 300u32..3000, 20u32..900),
        smp in 0u32..8,
        steps in prop::collection::vec(1u64..700, 1..30),
    ) {
        let end = 12_000;
        let mut whole = arrangement(periods, smp);
        whole.to(end);
        let mut cut = arrangement(periods, smp);
        for step in steps.iter().cycle() {
            let target = (cut.soc.now() + step).min(end);
            cut.to(target);
            if target == end {
                break;
            }
        }
        prop_assert_eq!(record(&mut whole), record(&mut cut));
    }

    /// Between now and the next event nothing that the outside can see changes, and events come in order.
    #[test]
    fn nothing_changes_before_the_next_event(periods in (50u32..3000, 300u32..3000, 20u32..900), smp in 0u32..8) {
        let mut bench = arrangement(periods, smp);
        bench.to(0);
        while bench.soc.now() < 12_000 {
            let next = bench.soc.next_event().unwrap_or(u64::MAX);
            prop_assert!(next > bench.soc.now());
            let lines = *bench.soc.irq_lines();
            let edges = bench.world.edges.len();
            bench.to(next - 1);
            prop_assert_eq!(&lines, bench.soc.irq_lines());
            prop_assert_eq!(edges, bench.world.edges.len());
            bench.to(next);
            // A program's handlers: flags off, so that lines move again.
            bench.set(TIM5 + SR, 0);
            bench.set(DMA2 + 8, 0x3D);
            bench.set(ADC1, !(1 << 2));
            bench.set(EXTI + 0x14, 1);
        }
    }

    /// Any address, any width, any value: no panic, and an access that is not carried out leaves a lint.
    #[test]
    fn any_access_is_answered(accesses in prop::collection::vec((any::<u32>(), 0usize..65, 0u32..0x400, any::<u32>(), 0u8..6), 1..60)) {
        let others = [0x4000_7000, 0xE004_2000, 0x1FFF_7A00];
        let blocks = [TIM1, TIM2, TIM6, ADC1, ADC_CCR, DMA2, GPIOA, GPIOB, EXTI, SYSCFG, RCC, FLASH_ACR];
        let bases = [&blocks[..], &others].concat();
        let mut bench = Bench::clocked();
        for (wild, which, offset, value, kind) in accesses {
            let addr = if which < bases.len() { bases[which] + offset } else { wild };
            let width = [stm32f4_model::Width::Byte, stm32f4_model::Width::Half, stm32f4_model::Width::Word][usize::from(kind % 3)];
            if kind < 3 {
                bench.soc.write(addr, width, value);
            } else {
                let read = bench.soc.read(addr, width);
                prop_assert!(read <= width.mask());
            }
            bench.pass(u64::from(value % 5000));
            let _ = bench.soc.take_reset();
        }
        for lint in bench.soc.lints() {
            prop_assert!(!lint.to_string().is_empty());
        }
    }
}
