//! The water that the sensors of the installation measure: a day's curves, without trigonometry,
//! so that every platform computes the same bits.

use crate::simulate::random::Random;
use crate::time::{SECOND, Timestamp};

/// Holds what there is to measure at a point in time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Water {
    /// °C.
    pub(super) temperature: f64,
    /// Fraction of air saturation, 1 is 100 %.
    pub(super) do_saturation: f64,
    /// mg/L.
    pub(super) do_mg_l: f64,
    /// mS/cm at 25 °C.
    pub(super) conductivity: f64,
    /// NTU.
    pub(super) turbidity: f64,
    /// pH.
    pub(super) ph: f64,
    /// mV.
    pub(super) orp: f64,
    /// µg/L.
    pub(super) chlorophyll: f64,
    /// Blue-green algae in cells/mL.
    pub(super) bga: f64,
    /// Of the sensors, in V.
    pub(super) supply_voltage: f64,
}

/// Swings from -1 to 1 once a day, highest at `peak` o'clock (UTC): a parabola like a sine.
fn day_curve(time: Timestamp, peak: f64) -> f64 {
    let hours = time.as_ns().rem_euclid(86_400 * SECOND) as f64 / (3600 * SECOND) as f64;
    let turns = (hours - peak + 30.0) / 24.0; // 30 keeps it positive, with the peak at a quarter turn
    let swing = 1.0 - 2.0 * (turns - turns.floor());
    4.0 * swing * (1.0 - swing.abs())
}

impl Water {
    /// Returns a temperate lake in winter sun, as noisy as a good probe.
    pub(super) fn at(time: Timestamp, random: &mut Random) -> Self {
        let mut noise = |amplitude: f64| amplitude * (2.0 * random.fraction() - 1.0);
        let temperature = 14.2 + 1.6 * day_curve(time, 15.5) + noise(0.01);
        let do_saturation = 0.905 + 0.055 * day_curve(time, 16.5) + noise(0.0015);
        // Saturation in fresh water at sea level: ASCE Committee on Sanitary Engineering Research, 1960.
        let (t, t2, t3) = (temperature, temperature * temperature, temperature * temperature * temperature);
        let saturated = 14.652 - 0.410_22 * t + 0.007_991 * t2 - 0.000_077_774 * t3;
        Water {
            temperature,
            do_saturation,
            do_mg_l: do_saturation * saturated,
            conductivity: 0.803 - 0.012 * day_curve(time, 4.0) + noise(0.0008),
            turbidity: 4.2 + 1.1 * day_curve(time, 20.0) + noise(0.15),
            ph: 7.9 + 0.12 * day_curve(time, 16.0) + noise(0.005),
            orp: 214.0 - 18.0 * day_curve(time, 14.0) + noise(0.8),
            chlorophyll: 3.4 + 0.7 * day_curve(time, 12.0) + noise(0.08),
            bga: 1180.0 + 220.0 * day_curve(time, 13.0) + noise(25.0),
            supply_voltage: 12.31 + 0.25 * day_curve(time, 12.5) + noise(0.02),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_day_curve_peaks_at_its_hour_and_is_lowest_twelve_hours_later() {
        let oclock = |hours: i64| Timestamp::from_ns(hours * 3600 * SECOND);
        assert_eq!(day_curve(oclock(15), 15.0), 1.0);
        assert_eq!(day_curve(oclock(3), 15.0), -1.0);
        assert!(day_curve(oclock(10), 15.0) > day_curve(oclock(9), 15.0));
    }

    #[test]
    fn the_water_stays_plausible_all_day() {
        let mut random = Random::new(3, 0);
        for minute in 0..1440 {
            let water = Water::at(Timestamp::from_ns(minute * 60 * SECOND), &mut random);
            assert!((12.0..17.0).contains(&water.temperature));
            assert!((0.84..0.97).contains(&water.do_saturation));
            assert!((7.5..10.5).contains(&water.do_mg_l));
            assert!((0.75..0.85).contains(&water.conductivity));
            assert!((7.7..8.1).contains(&water.ph));
        }
    }
}
