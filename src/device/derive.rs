//! Formulas of the manuals: values calculated from what was read.

/// Holds what derived values need and the bus does not tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// Salinity of the water in ‰ (g/kg), 0 for fresh water.
    pub salinity: f64,
    /// Barometric pressure in kPa.
    pub pressure_kpa: f64,
}

impl Default for Environment {
    /// Returns fresh water at standard pressure, what the manual starts from.
    fn default() -> Self {
        Environment { salinity: 0.0, pressure_kpa: STANDARD_PRESSURE_KPA }
    }
}

const STANDARD_PRESSURE_KPA: f64 = 101.325;
const STANDARD_PRESSURE_MMHG: f64 = 760.0;

/// Names a formula that a profile can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formula {
    /// Dissolved oxygen in mg/L from saturation (a fraction of 1) and temperature (°C).
    DoMgL,
    /// Total dissolved solids in mg/L from conductivity (mS/cm).
    Tds,
}

impl Formula {
    /// All formulas.
    pub(super) const ALL: [Formula; 2] = [Formula::DoMgL, Formula::Tds];

    /// Returns the name used in profiles.
    pub fn name(self) -> &'static str {
        match self {
            Formula::DoMgL => "do-mg-l",
            Formula::Tds => "tds",
        }
    }

    /// Returns what the inputs are, in order.
    pub fn inputs(self) -> &'static [&'static str] {
        match self {
            Formula::DoMgL => &["saturation as a fraction of 1", "temperature in °C"],
            Formula::Tds => &["conductivity in mS/cm"],
        }
    }

    /// Tells whether salinity and pressure matter.
    pub fn needs_environment(self) -> bool {
        self == Formula::DoMgL
    }

    /// Calculates; `None` where the formula gives no finite number or does not apply.
    pub fn evaluate(self, inputs: &[f64], environment: Environment) -> Option<f64> {
        let result = match (self, inputs) {
            (Formula::DoMgL, &[saturation, temperature]) => do_mg_l(saturation, temperature, environment)?,
            (Formula::Tds, &[conductivity]) if conductivity >= 0.0 => conductivity * TDS_MG_L_PER_MS_CM,
            _ => return None,
        };
        result.is_finite().then_some(result)
    }
}

/// TDS (mg/L) = conductivity (µS/cm) · 0.64 (conductivity manual, section 3), for mS/cm.
const TDS_MG_L_PER_MS_CM: f64 = 640.0;

/// The manual's mg per mL of oxygen (DO manual, section 3); the ideal gas value.
const MG_PER_ML: f64 = 1.4276;

/// Calculates dissolved oxygen in mg/L by the formula of the DO manual, section 3.
///
/// `saturation` is a fraction: the manual says percent, but its formula balances with a fraction only.
/// Without a pressure above 0 there is no result: the manual's sample code starts from 0.
fn do_mg_l(saturation: f64, temperature: f64, environment: Environment) -> Option<f64> {
    if environment.pressure_kpa <= 0.0 {
        return None;
    }
    let t = (temperature + 273.15) / 100.0;
    let salinity = environment.salinity;
    // Weiss 1970, mL/L in moist air at one atmosphere; `log` in the manual is the natural logarithm.
    let ml_per_l = (-173.4292
        + 249.6339 / t
        + 143.3483 * t.ln()
        + -21.8492 * t
        + salinity * (-0.033096 + 0.014259 * t + -0.001700 * t * t))
        .exp();
    // Vapour pressure of water in mmHg; here the manual's `log` is the decimal one.
    let vapour = 10_f64.powf(8.10765 - 1750.286 / (235.0 + temperature));
    let pressure = environment.pressure_kpa * STANDARD_PRESSURE_MMHG / STANDARD_PRESSURE_KPA;
    let correction = (pressure - vapour) / (STANDARD_PRESSURE_MMHG - vapour);
    Some(saturation * ml_per_l * correction * MG_PER_ML)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn do_mg_l(saturation: f64, temperature: f64, salinity: f64, pressure_kpa: f64) -> Option<f64> {
        Formula::DoMgL.evaluate(&[saturation, temperature], Environment { salinity, pressure_kpa })
    }

    /// Fraction, °C, salinity, kPa, vendor's mg/L, Benson-Krause's mg/L as in Standard Methods.
    const REFERENCE: [(f64, f64, f64, f64, f64, Option<f64>); 23] = [
        (1.0, 0.0, 0.0, 101.325, 14.5873, Some(14.6208)),
        (1.0, 5.0, 0.0, 101.325, 12.7447, Some(12.7710)),
        (1.0, 10.0, 0.0, 101.325, 11.2658, Some(11.2879)),
        (1.0, 15.0, 0.0, 101.325, 10.0616, Some(10.0839)),
        (1.0, 17.625, 0.0, 101.325, 9.5168, Some(9.5403)),
        (1.0, 20.0, 0.0, 101.325, 9.0674, Some(9.0924)),
        (1.0, 25.0, 0.0, 101.325, 8.2360, Some(8.2635)),
        (1.0, 30.0, 0.0, 101.325, 7.5317, Some(7.5588)),
        (1.0, 40.0, 0.0, 101.325, 6.4037, Some(6.4127)),
        (1.0, 20.0, 0.0, 90.0, 8.0301, Some(8.0528)),
        (1.0, 20.0, 0.0, 80.0, 7.1140, Some(7.1347)),
        (1.0, 20.0, 0.0, 105.0, 9.4041, Some(9.4297)),
        (1.0, 20.0, 10.0, 101.325, 8.5475, Some(8.5715)),
        (1.0, 20.0, 35.0, 101.325, 7.3744, Some(7.3961)),
        (1.0, 0.0, 35.0, 101.325, 11.4851, Some(11.4457)),
        (1.0, 25.0, 35.0, 95.0, 6.3129, Some(6.3360)),
        (0.9, 20.0, 0.0, 101.325, 8.1607, None),
        (0.5, 10.0, 0.0, 101.325, 5.6329, None),
        (1.2, 25.0, 0.0, 101.325, 9.8832, None),
        (0.95, 25.0, 35.0, 101.325, 6.4103, None),
        (0.9, 15.0, 10.0, 95.0, 7.9767, None),
        (0.0, 20.0, 0.0, 101.325, 0.0, None),
        (17.625, 17.625, 0.0, 101.325, 167.73, None),
    ];

    #[test]
    fn dissolved_oxygen_agrees_with_the_vendors_formula_and_with_published_tables() {
        for (saturation, temperature, salinity, pressure, vendor, published) in REFERENCE {
            let value = do_mg_l(saturation, temperature, salinity, pressure).expect("a value");
            let close = (value - vendor).abs() <= 0.0001 + vendor * 0.0001;
            assert!(close, "{saturation} {temperature} {salinity} {pressure}: {value}, not {vendor}");
            if let Some(published) = published {
                assert!((value / published - 1.0).abs() < 0.005, "{value} beside published {published}");
            }
        }
    }

    #[test]
    fn dissolved_oxygen_agrees_with_the_vendors_tool_within_three_percent() {
        // The tool shows 82.03 %, 26.21 °C, 101.35 kPa and 6.54 mg/L.
        let value = do_mg_l(0.8203, 26.21, 0.0, 101.35).expect("a value");
        assert!((value / 6.54 - 1.0).abs() < 0.03, "{value}");
    }

    #[test]
    fn dissolved_oxygen_has_no_value_where_the_formula_has_none() {
        assert_eq!(do_mg_l(1.0, 20.0, 0.0, 0.0), None, "the sample code's pressure");
        assert_eq!(do_mg_l(1.0, -300.0, 0.0, 101.325), None, "below absolute zero");
        assert_eq!(do_mg_l(1.0, f64::NAN, 0.0, 101.325), None);
        assert_eq!(Formula::DoMgL.evaluate(&[1.0], Environment::default()), None, "an input is missing");
    }

    #[test]
    fn dissolved_solids_are_640_mg_per_l_for_each_millisiemens() {
        let tds = |conductivity: f64| Formula::Tds.evaluate(&[conductivity], Environment::default());
        for (conductivity, solids) in [
            (0.66171, 423.49),
            (1.413, 904.32),
            (7.625, 4880.0),
            (12.88, 8243.2),
            (17.625, 11280.0),
            (0.0, 0.0),
        ] {
            let value = tds(conductivity).expect("a value");
            assert!((value - solids).abs() < 0.005, "{value}, not {solids}");
        }
        assert_eq!(tds(-0.01), None);
    }
}
