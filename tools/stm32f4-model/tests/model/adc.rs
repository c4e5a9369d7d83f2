//! Tests of the ADC: codes, order, timing, triggers, overrun.

use stm32f4_model::{AdcChannel, Conversion, SocConfig};

use crate::bench::*;

const SR: u32 = ADC1;
const CR1: u32 = ADC1 + 0x04;
const CR2: u32 = ADC1 + 0x08;
const SMPR1: u32 = ADC1 + 0x0C;
const SMPR2: u32 = ADC1 + 0x10;
const JOFR1: u32 = ADC1 + 0x14;
const SQR1: u32 = ADC1 + 0x2C;
const SQR2: u32 = ADC1 + 0x30;
const SQR3: u32 = ADC1 + 0x34;
const JSQR: u32 = ADC1 + 0x38;
const JDR1: u32 = ADC1 + 0x3C;
const DR: u32 = ADC1 + 0x4C;

const ADON: u32 = 1;
const CONT: u32 = 1 << 1;
const EOCS: u32 = 1 << 10;
const ALIGN: u32 = 1 << 11;
const SWSTART: u32 = 1 << 30;
const JSWSTART: u32 = 1 << 22;
const SCAN: u32 = 1 << 8;

const EOC: u32 = 1 << 1;
const JEOC: u32 = 1 << 2;
const JSTRT: u32 = 1 << 3;
const STRT: u32 = 1 << 4;
const OVR: u32 = 1 << 5;

/// HCLK cycles per ADCCLK cycle on the bench: 16 MHz, PCLK2 = HCLK, ADCPRE = 2.
const K: u64 = 2;

/// ADC1 is on; its channel n has n * 0.1 V; VDDA 3.0 V; pins PA0 to PA7 analog. No conversion started.
fn adc() -> Bench {
    let mut bench = Bench::clocked();
    bench.plant.volts = Box::new(|channel, _| f64::from(channel.channel) * 0.1);
    bench.set(GPIOA, 0xA800_FFFF);
    bench.set(CR2, ADON);
    bench
}

/// The code of a voltage at VDDA = 3.0 V.
fn code(volts: f64) -> u32 {
    (volts / 3.0 * 4095.0).round() as u32
}

fn delivered(bench: &mut Bench) -> Vec<(u64, bool, u8)> {
    bench.soc.conversions().map(|c| (c.cycle, c.injected, c.channel.channel)).collect()
}

#[test]
fn one_conversion_takes_sampling_plus_twelve_cycles() {
    // 13.5: the sampling time by SMPx, then 12 ADCCLK cycles for 12 bits.
    for (field, sampling) in [3, 15, 28, 56, 84, 112, 144, 480].into_iter().enumerate() {
        let mut bench = adc();
        bench.set(SQR3, 5);
        bench.set(SMPR2, (field as u32) << 15);
        bench.to(1000);
        bench.set(CR2, ADON | SWSTART);
        assert_eq!(bench.get(SR), STRT);
        let end = 1000 + (sampling + 12) * K;
        bench.to(end - 1);
        assert_eq!(bench.get(SR), STRT);
        bench.to(end);
        assert_eq!(bench.get(SR), STRT | EOC);
        assert_eq!(bench.get(DR), code(0.5));
        assert_eq!(bench.get(SR), STRT, "reading DR clears EOC");
        // The voltage is that at the end of the sampling time.
        assert_eq!(bench.plant.sampled, [(AdcChannel { adc: 1, channel: 5 }, (1000 + sampling * K) as f64 / 16e6)]);
        let kept: Vec<Conversion> = bench.soc.conversions().collect();
        let channel = AdcChannel { adc: 1, channel: 5 };
        assert_eq!(kept, [Conversion { cycle: end, channel, injected: false, code: code(0.5) as u16 }]);
    }
}

#[test]
fn every_channel_has_its_own_sampling_time() {
    // 13.13.4, 13.13.5: channels 0 to 9 in SMPR2, 10 to 18 in SMPR1, three bits each.
    for channel in 0..19 {
        for other in 0..19 {
            let mut bench = adc();
            let (register, place) = if other < 10 { (SMPR2, other) } else { (SMPR1, other - 10) };
            bench.set(register, 7 << (3 * place));
            bench.set(SQR3, channel);
            bench.set(CR2, ADON | SWSTART);
            bench.to(15 * K);
            assert_eq!(bench.get(SR) & EOC == 0, channel == other, "channel {channel}, SMP{other}");
        }
    }
}

#[test]
fn resolution_shortens_the_conversion_and_the_code() {
    // 13.7: 12, 10, 8 or 6 cycles.
    for (res, bits) in [(0, 12), (1, 10), (2, 8), (3, 6)] {
        let mut bench = adc();
        bench.set(CR1, res << 24);
        bench.set(SQR3, 6);
        bench.set(CR2, ADON | SWSTART);
        bench.to((3 + bits) * K - 1);
        assert_eq!(bench.get(SR) & EOC, 0);
        bench.to((3 + bits) * K);
        assert_eq!(bench.get(SR) & EOC, EOC);
        assert_eq!(bench.get(DR), code(0.6) >> (12 - bits));
    }
}

#[test]
fn alignment() {
    // 13.4, figures 48 to 50.
    for (res, shift) in [(0, 4), (1, 6), (2, 8), (3, 2)] {
        let mut bench = adc();
        bench.set(CR1, res << 24);
        bench.set(SQR3, 6);
        bench.set(CR2, ADON | ALIGN | SWSTART);
        bench.to(100);
        assert_eq!(bench.get(DR), code(0.6) >> (2 * res) << shift);
    }
}

#[test]
fn codes_are_limited_to_12_bits() {
    for (volts, wanted) in [(-1.0, 0), (0.0, 0), (1.5, 2048), (3.0, 4095), (5.0, 4095), (f64::NAN, 0)] {
        let mut bench = adc();
        bench.plant.volts = Box::new(move |_, _| volts);
        bench.set(CR2, ADON | SWSTART);
        bench.to(100);
        assert_eq!(bench.get(DR), wanted, "{volts} V");
    }
}

#[test]
fn the_code_follows_the_supply() {
    let mut bench = adc();
    bench.plant.volts = Box::new(|_, _| 1.0);
    bench.plant.vdda = Some(2.0);
    bench.set(CR2, ADON | SWSTART);
    bench.to(100);
    assert_eq!(bench.get(DR), 2048);
}

#[test]
fn internal_channels() {
    // 13.10, 13.11: on with TSVREFE and VBATE; 1.21 V against VDDA = 3.0 V, temperature 0.76 V at 25 degrees, half of VBAT.
    for (channel, enable, volts) in [(17, 1 << 23, 1.21), (16, 1 << 23, 0.76), (18, 1 << 22, 1.5)] {
        let mut bench = adc();
        bench.set(SMPR1, 0x07FF_FFFF);
        bench.set(SQR3, channel);
        bench.set(CR2, ADON | SWSTART);
        bench.to(1000);
        assert_eq!(bench.get(DR), 0, "channel {channel} is off");
        bench.set(ADC_CCR, enable);
        bench.set(CR2, ADON | SWSTART);
        bench.to(2000);
        assert_eq!(bench.get(DR), code(volts), "channel {channel}");
        assert!(bench.plant.sampled.is_empty(), "the plant does not supply it");
    }
}

#[test]
fn a_reference_sampled_too_shortly_is_recorded() {
    // Data sheet 6.3.24: 10 us at least; 144 cycles of 8 MHz are 18 us, 56 are 7.
    for (field, lint_texts) in [(6, 0), (3, 1)] {
        let mut bench = adc();
        bench.set(ADC_CCR, 1 << 23);
        bench.set(SMPR1, field << 21);
        bench.set(SQR3, 17);
        bench.set(CR2, ADON | SWSTART);
        bench.to(1000);
        assert_eq!(bench.lint_texts().len(), lint_texts, "{:?}", bench.lint_texts());
    }
}

#[test]
fn a_pin_that_is_not_analog_is_recorded() {
    let mut bench = adc();
    bench.set(GPIOA, 0xA800_0000);
    bench.set(SQR3, 3);
    bench.set(CR2, ADON | SWSTART);
    bench.to(100);
    assert!(bench.lint_texts()[0].contains("GPIOA+0x00 (misuse: the converted pin is not in analog mode)"));
}

#[test]
fn scan_converts_the_sequence_in_order() {
    // 13.3.7 and 13.13.9 to 13.13.11: SQ1 to SQ6 in SQR3, SQ7 to SQ12 in SQR2, L + 1 conversions.
    let mut bench = adc();
    bench.set(CR1, SCAN);
    bench.set(SQR1, 7 << 20);
    bench.set(SQR2, 2 | 6 << 5);
    bench.set(SQR3, 7 | 5 << 5 | 3 << 10 | 1 << 15 | 4 << 20 | 3 << 25);
    bench.set(CR2, ADON | SWSTART);
    bench.to(8 * 15 * K - 1);
    assert_eq!(bench.get(SR) & EOC, 0, "with EOCS = 0 EOC comes at the end of the sequence");
    bench.to(10_000);
    assert_eq!(bench.get(SR) & (EOC | OVR), EOC);
    let order = [7, 5, 3, 1, 4, 3, 2, 6].into_iter().zip(1..);
    let wanted: Vec<_> = order.map(|(channel, n)| (n * 15 * K, false, channel)).collect();
    assert_eq!(delivered(&mut bench), wanted);
    assert_eq!(bench.get(DR), code(0.6));
}

#[test]
fn without_scan_only_the_first_is_converted() {
    let mut bench = adc();
    bench.set(SQR1, 3 << 20);
    bench.set(SQR3, 4 | 5 << 5);
    bench.set(CR2, ADON | SWSTART);
    bench.to(10_000);
    assert_eq!(delivered(&mut bench), [(15 * K, false, 4)]);
}

#[test]
fn continuous_mode_continues_until_cont_is_cleared() {
    // 13.3.5.
    let mut bench = adc();
    bench.set(CR2, ADON | CONT | SWSTART);
    bench.to(15 * K * 10);
    assert_eq!(delivered(&mut bench).len(), 10);
    bench.set(CR2, ADON);
    bench.to(100_000);
    assert_eq!(delivered(&mut bench).len(), 1, "the running one is finished");
    assert_eq!(bench.soc.next_event(), None);
}

#[test]
fn eocs_flags_every_conversion_and_detects_overrun() {
    // 13.8.2 and 13.13.3: with EOCS = 1 EOC comes after each conversion; a result that finds the last one unread is lost, sets OVR,
    // and ends the conversions until OVR is cleared.
    let mut bench = adc();
    bench.set(CR1, SCAN | 1 << 26);
    bench.set(SQR1, 3 << 20);
    bench.set(SQR3, 1 | 2 << 5 | 3 << 10 | 4 << 15);
    bench.set(CR2, ADON | EOCS | SWSTART);
    bench.to(15 * K);
    assert_eq!(bench.get(DR), code(0.1));
    bench.to(2 * 15 * K);
    assert_eq!(bench.get(SR) & (EOC | OVR), EOC);
    assert!(!bench.irq(18));
    bench.to(3 * 15 * K);
    assert_eq!(bench.get(SR) & OVR, OVR);
    assert!(bench.irq(18));
    bench.to(10_000);
    assert_eq!(bench.get(DR), code(0.2), "the unread result is kept, the new one lost");
    assert_eq!(delivered(&mut bench).len(), 2);
    // A start has no effect while OVR is set.
    bench.set(CR2, ADON | EOCS | SWSTART);
    bench.to(20_000);
    assert_eq!(delivered(&mut bench).len(), 0);
    bench.set(SR, !OVR);
    bench.set(CR2, ADON | EOCS | SWSTART);
    bench.to(20_000 + 15 * K);
    assert_eq!(bench.get(DR), code(0.1));
}

#[test]
fn without_eocs_and_dma_no_overrun_is_detected() {
    // 13.13.3.
    let mut bench = adc();
    bench.plant.volts = Box::new(|_, seconds| seconds * 1000.0);
    bench.set(CR2, ADON | CONT | SWSTART);
    bench.to(15 * K * 100);
    assert_eq!(bench.get(SR) & OVR, 0);
    assert_eq!(bench.get(DR), code((15 * K * 100 - 12 * K) as f64 / 16e6 * 1000.0), "DR holds the latest");
}

#[test]
fn the_injected_group_ends_at_jsq4() {
    // 13.13.12: with JL = 1 JSQ3 and JSQ4 are converted, with JL = 0 only JSQ4; results go to JDR1 on.
    let jsqr = 1 | 2 << 5 | 3 << 10 | 4 << 15;
    for (jl, channels) in [(0, vec![4]), (1, vec![3, 4]), (2, vec![2, 3, 4]), (3, vec![1, 2, 3, 4])] {
        let mut bench = adc();
        bench.set(CR1, SCAN);
        bench.set(JSQR, jsqr | jl << 20);
        bench.set(CR2, ADON | JSWSTART);
        assert_eq!(bench.get(SR), JSTRT);
        assert_eq!(bench.get(CR2), ADON, "JSWSTART reads as 0 once started");
        bench.to(15 * K * channels.len() as u64 - 1);
        assert_eq!(bench.get(SR), JSTRT);
        bench.to(15 * K * channels.len() as u64);
        assert_eq!(bench.get(SR), JSTRT | JEOC);
        let got: Vec<u8> =
            delivered(&mut bench).iter().map(|&(_, injected, channel)| channel * u8::from(injected)).collect();
        assert_eq!(got, channels);
        for (rank, &channel) in channels.iter().enumerate() {
            assert_eq!(bench.get(JDR1 + 4 * rank as u32), code(f64::from(channel) * 0.1));
        }
    }
}

#[test]
fn injected_offset_makes_a_signed_result() {
    // 13.13.6, 13.13.13 and figure 48: JDRx = code - JOFRx, extended by its sign.
    let mut bench = adc();
    bench.set(JSQR, 1 << 15);
    bench.set(JOFR1, 1000);
    bench.set(CR2, ADON | JSWSTART);
    bench.to(100);
    let value = code(0.1) as i32 - 1000;
    assert_eq!(bench.get(JDR1), value as u32 & 0xFFFF);
    bench.set(CR2, ADON | ALIGN | JSWSTART);
    bench.to(200);
    assert_eq!(bench.get(JDR1), (value << 3) as u32 & 0xFFFF);
}

#[test]
fn a_timer_paces_the_injected_group_and_jeoc_interrupts() {
    // 13.6, table 67: JEXTSEL = 3 is TIM2's TRGO; 18.4.2: MMS = 2 is the update. As on the board: sensor and VREFINT at 1 kHz.
    let mut bench = adc();
    bench.run_at_168_mhz();
    bench.set(ADC_CCR, 1 << 23 | 1 << 16);
    bench.set(SMPR1, 7 << 21);
    bench.set(SMPR2, 4 << 3);
    bench.set(CR1, SCAN | 1 << 7);
    bench.set(JSQR, 1 << 20 | 1 << 10 | 17 << 15);
    bench.set(CR2, ADON | 3 << 16 | 1 << 20);
    bench.set(TIM2 + PSC, 83);
    bench.set(TIM2 + ARR, 999);
    bench.set(TIM2 + crate::bench::CR2, 2 << 4);
    bench.set(TIM2 + EGR, 1);
    bench.to(100_000);
    bench.soc.conversions();
    bench.set(SR, 0);
    let start = bench.soc.now();
    bench.set(TIM2 + crate::bench::CR1, 1);
    // ADCCLK = 84 MHz / 4 = 21 MHz, 8 HCLK cycles: 84 + 12 and 480 + 12 of them.
    let done = start + 168_000 + 8 * (96 + 492);
    bench.to(done - 1);
    assert!(!bench.irq(18));
    assert_eq!(bench.soc.next_event(), Some(done));
    bench.to(done);
    assert!(bench.irq(18));
    assert_eq!((bench.get(JDR1), bench.get(JDR1 + 4)), (code(0.1), code(1.21)));
    bench.set(SR, !JEOC);
    assert!(!bench.irq(18));
    bench.to(start + 168_000 * 1001);
    let channels: Vec<_> = delivered(&mut bench);
    assert_eq!(channels.len(), 2000);
    for (tick, pair) in channels.chunks(2).enumerate() {
        let trigger = start + 168_000 * (tick as u64 + 1);
        assert_eq!(pair, [(trigger + 8 * 96, true, 1), (trigger + 8 * (96 + 492), true, 17)]);
    }
    assert_eq!(bench.lint_texts(), [] as [String; 0]);
}

#[test]
fn every_trigger_source_of_both_groups() {
    // 13.6, tables 66 and 67. Each timer channel runs PWM mode 1 with its compare output on, each TRGO carries the update.
    let timers = [(1, TIM1), (2, TIM2), (3, TIM3), (4, 0x4000_0800), (5, TIM5), (8, 0x4001_0400)];
    let regular =
        ["1c1", "1c2", "1c3", "2c2", "2c3", "2c4", "2t", "3c1", "3t", "4c4", "5c1", "5c2", "5c3", "8c1", "8t"];
    let injected =
        ["1c4", "1t", "2c1", "2t", "3c2", "3c4", "4c1", "4c2", "4c3", "4t", "5c4", "5t", "8c2", "8c3", "8c4"];
    for (sources, select, edge) in [(regular, 24, 28), (injected, 16, 20)] {
        for (code, source) in sources.iter().enumerate() {
            for (number, base) in timers {
                for channel in 0..5 {
                    let mut bench = adc();
                    bench.set(base + ARR, 4000);
                    if channel == 4 {
                        bench.set(base + crate::bench::CR2, 2 << 4);
                    } else {
                        bench.set(base + CCMR1 + channel / 2 * 4, 0x70 << (channel % 2 * 8));
                        bench.set(base + CCR1 + channel * 4, 3000);
                        bench.set(base + CCER, 1 << (channel * 4));
                    }
                    bench.set(base + EGR, 1);
                    bench.set(CR2, ADON | (code as u32) << select | 1 << edge);
                    bench.set(base + crate::bench::CR1, 1);
                    bench.to(4500);
                    let name = if channel == 4 { format!("{number}t") } else { format!("{number}c{}", channel + 1) };
                    let count = delivered(&mut bench).len();
                    assert_eq!(count == 1, name == *source, "{name} on select {code} ({source}): {count}");
                }
            }
        }
    }
}

#[test]
fn trigger_edges() {
    // 13.6: EXTEN 1 rising, 2 falling, 3 both, 0 none. TIM2's OC1REF as TRGO: rises at 0, falls at 100, period 1000.
    for (exten, wanted) in [(0, vec![]), (1, vec![1000, 2000]), (2, vec![100, 1100]), (3, vec![100, 1000, 1100, 2000])]
    {
        let mut bench = adc();
        bench.set(TIM2 + ARR, 999);
        bench.set(TIM2 + CCR1, 100);
        bench.set(TIM2 + CCMR1, 0x60);
        bench.set(TIM2 + crate::bench::CR2, 4 << 4);
        bench.set(TIM2 + EGR, 1);
        bench.set(CR2, ADON | 6 << 24 | exten << 28);
        bench.set(TIM2 + crate::bench::CR1, 1);
        bench.to(2040);
        let starts: Vec<u64> = delivered(&mut bench).iter().map(|&(end, ..)| end - 15 * K).collect();
        assert_eq!(starts, wanted, "EXTEN = {exten}");
    }
}

#[test]
fn an_update_is_a_pulse_with_two_edges() {
    // 18.4.2: MMS = 2; either edge starts a conversion.
    for exten in 1..=3 {
        let mut bench = adc();
        bench.set(TIM2 + ARR, 999);
        bench.set(TIM2 + crate::bench::CR2, 2 << 4);
        bench.set(CR2, ADON | 6 << 24 | exten << 28);
        bench.set(TIM2 + crate::bench::CR1, 1);
        bench.to(2500);
        assert_eq!(delivered(&mut bench).len(), 2, "EXTEN = {exten}");
    }
}

#[test]
fn an_injected_trigger_interrupts_the_regular_group() {
    // 13.3.9: the running regular conversion is aborted and repeated after the injected group.
    let mut bench = adc();
    bench.set(CR1, SCAN);
    bench.set(SQR1, 2 << 20);
    bench.set(SQR3, 1 | 2 << 5 | 3 << 10);
    bench.set(JSQR, 7 << 15);
    bench.set(CR2, ADON | SWSTART);
    bench.to(20 * K);
    bench.set(CR2, ADON | JSWSTART);
    bench.to(10_000);
    let t = |cycles| cycles * K;
    assert_eq!(delivered(&mut bench), [(t(15), false, 1), (t(35), true, 7), (t(50), false, 2), (t(65), false, 3)]);
}

#[test]
fn a_regular_trigger_waits_for_the_injected_group() {
    // 13.3.9.
    let mut bench = adc();
    bench.set(SQR3, 1);
    bench.set(JSQR, 7 << 15);
    bench.set(CR2, ADON | JSWSTART);
    bench.to(5 * K);
    bench.set(CR2, ADON | SWSTART);
    bench.to(10_000);
    assert_eq!(delivered(&mut bench), [(15 * K, true, 7), (30 * K, false, 1)]);
}

#[test]
fn auto_injection_follows_the_regular_group() {
    // 13.3.9: JAUTO; with CONT both groups alternate.
    let mut bench = adc();
    bench.set(CR1, SCAN | 1 << 10);
    bench.set(SQR3, 1);
    bench.set(JSQR, 7 << 15);
    bench.set(CR2, ADON | CONT | SWSTART);
    bench.to(45 * K);
    assert_eq!(delivered(&mut bench), [(15 * K, false, 1), (30 * K, true, 7), (45 * K, false, 1)]);
}

#[test]
fn analog_watchdog() {
    // 13.3.8: AWD outside of LTR ..= HTR, on one channel with AWDSGL.
    let single = 1 << 9;
    let cases = [
        // Channel 5 gives the code 683.
        (5, 683, 683, single, false),
        (5, 682, 0, single, true),
        (5, 4095, 684, single, true),
        (4, 500, 0, single, false),
        (4, 500, 0, 0, true),
    ];
    for (channel, high, low, mode, flagged) in cases {
        for (enable, start) in [(1 << 23, SWSTART), (1 << 22, JSWSTART), (1 << 23, JSWSTART), (1 << 22, SWSTART)] {
            let mut bench = adc();
            bench.set(ADC1 + 0x24, high);
            bench.set(ADC1 + 0x28, low);
            bench.set(CR1, enable | mode | 5 | 1 << 6);
            bench.set(SQR3, channel);
            bench.set(JSQR, channel << 15);
            bench.set(CR2, ADON | start);
            bench.to(100);
            // AWDEN guards the regular group, JAWDEN the injected one.
            let guarded = (enable == 1 << 23) == (start == SWSTART);
            assert_eq!(bench.get(SR) & 1 != 0, flagged && guarded);
            assert_eq!(bench.irq(18), flagged && guarded);
        }
    }
}

#[test]
fn the_guarded_channel_has_five_bits() {
    // 13.13.2: AWDCH = 17 does not guard channel 1.
    for (channel, flagged) in [(1, false), (17, true)] {
        let mut bench = adc();
        bench.set(ADC_CCR, 1 << 23);
        bench.set(ADC1 + 0x24, 10);
        bench.set(CR1, 1 << 23 | 1 << 9 | 17);
        bench.set(SQR3, channel);
        bench.set(CR2, ADON | SWSTART);
        bench.to(100);
        assert_eq!(bench.get(SR) & 1 != 0, flagged);
    }
}

#[test]
fn one_timer_may_trigger_two_converters() {
    // 13.6: TIM2's OC1REF as TRGO for ADC1, its channel 2 for ADC2.
    let mut bench = adc();
    bench.set(TIM2 + ARR, 999);
    bench.set(TIM2 + CCMR1, 0x7070);
    bench.set(TIM2 + CCR1, 300);
    bench.set(TIM2 + CCR1 + 4, 400);
    bench.set(TIM2 + CCER, 1 << 4);
    bench.set(TIM2 + crate::bench::CR2, 4 << 4);
    bench.set(TIM2 + EGR, 1);
    bench.set(CR2, ADON | 6 << 24 | 1 << 28);
    bench.set(CR2 + 0x100, ADON | 3 << 24 | 1 << 28);
    bench.set(TIM2 + crate::bench::CR1, 1);
    bench.to(900);
    let ends: Vec<(u8, u64)> = bench.soc.conversions().map(|c| (c.channel.adc, c.cycle)).collect();
    assert_eq!(ends, [(1, 300 + 15 * K), (2, 400 + 15 * K)]);
}

#[test]
fn nothing_is_converted_without_adon() {
    // 13.3.1.
    let mut bench = adc();
    bench.set(CR2, SWSTART);
    bench.to(1000);
    assert_eq!((bench.get(SR), delivered(&mut bench).len()), (0, 0));
    bench.set(CR2, ADON | SWSTART);
    bench.pass(5);
    bench.set(CR2, 0);
    bench.pass(1000);
    assert_eq!(delivered(&mut bench).len(), 0, "clearing ADON stops the conversion");
}

#[test]
fn the_common_status_shows_all_three() {
    // 13.13.15.
    let mut bench = adc();
    bench.set(ADC1 + 0x100 + 0x08, ADON);
    bench.set(ADC1 + 0x100 + 0x08, ADON | SWSTART);
    bench.to(100);
    assert_eq!(bench.get(ADC1 + 0x300), (STRT | EOC) << 8);
    bench.set(CR2, ADON | JSWSTART);
    bench.to(200);
    assert_eq!(bench.get(ADC1 + 0x300), (STRT | EOC) << 8 | JSTRT | JEOC);
    bench.set(APB2RSTR, 1 << 8);
    bench.set(APB2RSTR, 0);
    bench.set(ADC_CCR, 1 << 16);
    bench.set(APB2RSTR, 1 << 8);
    bench.set(APB2RSTR, 0);
    assert_eq!(bench.get(ADC_CCR), 0, "7.3.9: one reset bit for all");
    bench.set(ADC_CCR, 6);
    assert!(bench.lint_texts().iter().any(|text| text.contains("dual or triple")));
}

#[test]
fn factory_calibration() {
    // Data sheet 6.3.24: VREFINT_CAL at 0x1FFF7A2A, taken at 3.3 V: 1.21 / 3.3 * 4095.
    let mut bench = Bench::new();
    assert_eq!(bench.soc.read(0x1FFF_7A2A, stm32f4_model::Width::Half), 1502);
    assert_eq!(bench.soc.read(0x1FFF_7A22, stm32f4_model::Width::Half), 1024);
    assert_eq!(bench.get(0x1FFF_7A10), SocConfig::default().unique_id[0]);
    // 0.76 V at 25 degrees and 2.5 mV/K: at 30 and 110 degrees against 3.3 V.
    assert_eq!((bench.get(0x1FFF_7A2C) & 0xFFFF, bench.get(0x1FFF_7A2C) >> 16), (959, 1207));
    let mut bench = Bench::with(SocConfig { vrefint_cal: Some(1489), ..SocConfig::default() });
    assert_eq!(bench.soc.read(0x1FFF_7A2A, stm32f4_model::Width::Half), 1489);
}
