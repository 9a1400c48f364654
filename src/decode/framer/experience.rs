//! What the framer has learnt about the bus: which units talk, how fast they answer, whether it echoes.

use crate::decode::shape::Shapes;
use crate::time::MILLISECOND;

/// Nanoseconds within which a unit answers, before three of its answers were seen.
const FIRST_LIMIT_NS: i64 = 250 * MILLISECOND;

#[derive(Clone, Copy, Debug, Default)]
struct Latency {
    answers: u32,
    mean: f32,
    deviation: f32,
}

/// Keeps counts and running means; everything in it comes from frames already handed out.
#[derive(Clone, Debug)]
pub struct Experience {
    frames: [u8; 256],
    functions: [u8; 256],
    latency: Vec<Latency>,
    service: [bool; 256],
    echoes: f32,
    requests: f32,
    hold_ns: i64,
    trusts_any: bool,
    epoch: u32,
}

impl Experience {
    /// Makes an experience of nothing.
    pub fn new(shapes: &Shapes) -> Self {
        let mut service = [false; 256];
        for &address in &shapes.service_addresses {
            service[usize::from(address)] = true;
        }
        Experience {
            frames: [0; 256],
            functions: [0; 256],
            latency: vec![Latency::default(); 256],
            service,
            echoes: 0.02 * 20.0,
            requests: 20.0,
            hold_ns: 0,
            trusts_any: false,
            epoch: 0,
        }
    }

    /// Sets the longest time the adapter keeps a byte back, in nanoseconds.
    pub fn set_hold_ns(&mut self, hold_ns: i64) {
        self.hold_ns = hold_ns;
    }

    /// Returns the longest time the adapter keeps a byte back, in nanoseconds.
    pub fn hold_ns(&self) -> i64 {
        self.hold_ns
    }

    /// Scores a unit address: known ones are likelier, reserved ones are not.
    pub fn unit(&self, address: u8) -> f32 {
        match (self.frames[usize::from(address)], address) {
            (2.., _) => 1.5,
            (1, 1..=247) => 0.0,
            (_, 0) => -1.0,
            (_, 248..) if !self.service[usize::from(address)] => -3.0,
            _ => -1.5,
        }
    }

    /// Tells whether two or more frames of the unit were seen.
    pub fn knows_unit(&self, address: u8) -> bool {
        self.frames[usize::from(address)] >= 2
    }

    /// Tells whether an unknown function code was accepted twice.
    pub fn trusts_function(&self, function: u8) -> bool {
        self.functions[usize::from(function)] >= 2
    }

    /// Tells whether any unknown function code was accepted twice.
    pub fn trusts_any(&self) -> bool {
        self.trusts_any
    }

    /// Counts the changes of what is thought of units and functions: scores without time are the same in between.
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// Tells whether devices answer at the reserved address.
    pub fn is_service(&self, address: u8) -> bool {
        self.service[usize::from(address)]
    }

    /// Counts a frame; `any_length` when only its CRC showed its end.
    pub fn saw_frame(&mut self, address: u8, function: u8, any_length: bool) {
        let frames = &mut self.frames[usize::from(address)];
        if *frames < 2 {
            *frames += 1;
            self.epoch += 1;
        }
        if any_length {
            let functions = &mut self.functions[usize::from(function)];
            *functions = functions.saturating_add(1);
            self.trusts_any |= *functions >= 2;
            self.epoch += 1;
        }
    }

    /// Counts a request, or the echo of one.
    pub fn saw_request(&mut self, echo: bool) {
        if echo {
            self.echoes += 1.0;
        } else {
            self.requests += 1.0;
        }
        // An adapter is swapped, a setting changed: old counts fade.
        if self.requests > 400.0 {
            self.requests /= 2.0;
            self.echoes /= 2.0;
        }
    }

    fn echo_ratio(&self) -> f32 {
        (self.echoes / self.requests).clamp(0.001, 0.999)
    }

    /// Returns the logarithm of the share of requests that are echoed.
    pub fn ln_echo(&self) -> f32 {
        self.echo_ratio().ln()
    }

    /// Returns the logarithm of the share of requests that are not echoed.
    pub fn ln_no_echo(&self) -> f32 {
        (1.0 - self.echo_ratio()).ln()
    }

    /// Takes in how long a unit took to answer, in nanoseconds.
    pub fn saw_latency(&mut self, address: u8, latency_ns: i64) {
        let latency = &mut self.latency[usize::from(address)];
        latency.answers = latency.answers.saturating_add(1);
        let weight = 1.0 / (latency.answers.min(16) as f32);
        let error = latency_ns as f32 - latency.mean;
        latency.mean += error * weight;
        latency.deviation += (error.abs() - latency.deviation) * weight;
    }

    /// Returns the nanoseconds within which a unit usually answers.
    pub fn limit_ns(&self, address: u8) -> i64 {
        let latency = &self.latency[usize::from(address)];
        if latency.answers < 3 {
            return FIRST_LIMIT_NS + self.hold_ns;
        }
        let usual = (latency.mean + 6.0 * latency.deviation) as i64; // saturates
        usual.saturating_add(10 * MILLISECOND).saturating_add(self.hold_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_known_after_two_frames_and_a_service_address_is_no_stranger() {
        let shapes = Shapes { service_addresses: vec![255], ..Shapes::default() };
        let mut experience = Experience::new(&shapes);
        assert!(experience.unit(255) > experience.unit(254));
        assert!(experience.unit(7) < 0.0);
        experience.saw_frame(7, 3, false);
        assert!(!experience.knows_unit(7));
        experience.saw_frame(7, 3, false);
        assert!(experience.knows_unit(7) && experience.unit(7) > 0.0);
    }

    #[test]
    fn the_limit_follows_the_answers_of_the_unit() {
        let mut experience = Experience::new(&Shapes::default());
        assert_eq!(experience.limit_ns(1), FIRST_LIMIT_NS);
        for _ in 0..10 {
            experience.saw_latency(1, 20 * MILLISECOND);
        }
        let limit = experience.limit_ns(1);
        assert!((30 * MILLISECOND..150 * MILLISECOND).contains(&limit), "{limit}");
        assert_eq!(experience.limit_ns(2), FIRST_LIMIT_NS);
    }

    #[test]
    fn echoes_become_likely_once_seen() {
        let mut experience = Experience::new(&Shapes::default());
        let before = experience.ln_echo();
        for _ in 0..50 {
            experience.saw_request(false);
            experience.saw_request(true);
        }
        assert!(experience.ln_echo() > before + 2.0);
    }
}
