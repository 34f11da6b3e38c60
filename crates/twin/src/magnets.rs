//! A simulated machine with a Hall sensor above a ring of magnets, for trying out a calibration
//! where no machine is at hand.
//!
//! Field: an axially magnetised cylinder, exactly (N. Derby, S. Olbert, "Cylindrical magnets and
//! ideal solenoids", American Journal of Physics 78, 2010, by R. Bulirsch's general complete
//! elliptic integral). The machine misses its axis, its bed has play, its carriage too; the sensor
//! has noise, hysteresis, a delay, and is read so many times a second.

use machine::backlash::LooseBed;
use machine::calibration::rig::{Rig, RigError};
use machine::program::BedTurn;
use nalgebra::{Rotation2, Vector2};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A cylinder, its axis upright.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// mm.
    pub radius: f64,
    /// mm.
    pub length: f64,
    /// Remanence, mT.
    pub remanence: f64,
}

impl Cylinder {
    /// 3 mm across, 5 mm long, of the usual N42.
    pub const SMALL: Self = Self { radius: 1.5, length: 5.0, remanence: 1300.0 };

    /// Returns the upright part of the field, mT, at a height above the upper face and a distance
    /// from the axis, mm.
    #[must_use]
    pub fn field(&self, gap: f64, distance: f64) -> f64 {
        let (a, rho) = (self.radius, distance);
        // At the rim itself the third argument would be 0, where the integral is a limit.
        let gamma = (a - rho) / (a + rho);
        let gamma = if gamma.abs() < 1e-9 { 1e-9 } else { gamma };
        let end = |z: f64| {
            let square = z * z + (rho + a).powi(2);
            let k = ((z * z + (a - rho).powi(2)) / square).sqrt();
            z / square.sqrt() * elliptic(k, gamma * gamma, 1.0, gamma)
        };
        self.remanence / PI * a / (a + rho) * (end(gap + self.length) - end(gap))
    }
}

/// Bulirsch's general complete elliptic integral for `p > 0`, by the arithmetic-geometric mean.
fn elliptic(kc: f64, p: f64, c: f64, s: f64) -> f64 {
    // The mean converges quadratically: below this the next step is exact.
    const STILL: f64 = 1e-8;
    let (mut k, mut cc, mut em) = (kc.abs().max(f64::MIN_POSITIVE), c, 1.0);
    let mut pp = p.sqrt();
    let mut ss = s / pp;
    let mut f = cc;
    cc += ss / pp;
    let mut g = k / pp;
    ss = 2.0 * (ss + f * g);
    pp += g;
    g = em;
    em += k;
    let mut kk = k;
    while (g - k).abs() > g * STILL {
        k = 2.0 * kk.sqrt();
        kk = k * em;
        f = cc;
        cc += ss / pp;
        g = kk / pp;
        ss = 2.0 * (ss + f * g);
        pp += g;
        g = em;
        em += k;
    }
    FRAC_PI_2 * (ss + cc * em) / (em * (em + pp))
}

/// Chance that is the same on every run: Marsaglia (2003), "Xorshift RNGs".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chance(u64);

impl Chance {
    /// Returns the chance of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let mut chance = Self(seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        // Seeds that differ little begin alike.
        for _ in 0..16 {
            chance.uniform(0.0, 1.0);
        }
        chance
    }

    /// Returns a number between two others.
    pub fn uniform(&mut self, min: f64, max: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        min + (max - min) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a normally distributed number about 0, by Marsaglia's polar method.
    pub fn normal(&mut self, sd: f64) -> f64 {
        loop {
            let (x, y) = (self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0));
            let square = x * x + y * y;
            if square > 0.0 && square < 1.0 {
                return sd * x * (-2.0 * square.ln() / square).sqrt();
            }
        }
    }
}

/// A machine and its sensor, as they really are.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// True minus commanded position of the sensor along the rail, mm.
    pub a: f64,
    /// By how much the sensor misses the axis, mm.
    pub b: f64,
    /// Where magnets stand on the bed, mm from the axis.
    pub magnets: Vec<Vector2<f64>>,
    /// What they are.
    pub cylinder: Cylinder,
    /// From their faces to the sensor, mm.
    pub gap: f64,
    /// Play of the bed's drive, radians.
    pub bed_play: f64,
    /// Play of the carriage, mm.
    pub rail_play: f64,
    /// Levels at which the sensor switches on and off, mT.
    pub switches: [f64; 2],
    /// Noise of the field, mT.
    pub noise: f64,
    /// From the field to the count, s.
    pub delay: f64,
    /// Speed of the bed, radians/s.
    pub speed: f64,
    /// Readings of the digital sensor a second.
    pub rate: f64,
    /// Whether the sensor always says that it is on.
    pub is_stuck: bool,
    /// Steps that the bed loses when this many sweeps are over, radians.
    pub slips: Option<(usize, f64)>,
}

impl Default for Machine {
    fn default() -> Self {
        Self {
            a: 0.0,
            b: 0.0,
            magnets: Vec::new(),
            cylinder: Cylinder::SMALL,
            gap: 2.5,
            bed_play: 0.05_f64.to_radians(),
            rail_play: 0.020,
            switches: [30.0, 28.0],
            noise: 0.3,
            delay: 0.000_3,
            speed: 60_f64.to_radians(),
            rate: 5000.0,
            is_stuck: false,
            slips: None,
        }
    }
}

/// Beyond this distance from a magnet there is no field to speak of, mm.
const FIELD_ENDS: f64 = 12.0;

/// Step of the table of the field, mm: straight between, exact to a microtesla.
const TABLE_STEP: f64 = 0.01;

/// A sensor of ±100 mT read with 10 bits, mT.
const SATURATES: f64 = 100.0;
const BIT: f64 = 0.35;

/// The simulation.
#[derive(Debug, Clone)]
pub struct SimulatedRig {
    machine: Machine,
    table: Vec<f64>,
    chance: Chance,
    s_told: f64,
    s_true: f64,
    drive: f64,
    bed: LooseBed,
    bed_true: f64,
    is_on: bool,
    n_sweeps: usize,
    slipped: f64,
    time: f64,
    n_moves: usize,
    is_parked: bool,
}

impl SimulatedRig {
    /// Returns a machine at rest; the same seed gives the same noise.
    #[must_use]
    pub fn new(machine: Machine, seed: u64) -> Self {
        let n_steps = (FIELD_ENDS / TABLE_STEP) as usize + 2;
        let table = (0..n_steps)
            .map(|k| machine.cylinder.field(machine.gap, TABLE_STEP * k as f64))
            .collect();
        let bed = LooseBed::new(machine.bed_play, BedTurn::default());
        Self {
            machine,
            table,
            chance: Chance::new(seed),
            s_told: 0.0,
            s_true: 0.0,
            drive: 0.0,
            bed,
            bed_true: 0.0,
            is_on: false,
            n_sweeps: 0,
            slipped: 0.0,
            time: 0.0,
            n_moves: 0,
            is_parked: false,
        }
    }

    /// Returns how long the machine was busy, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Returns how many moves it made.
    #[must_use]
    pub fn n_moves(&self) -> usize {
        self.n_moves
    }

    /// Returns whether it was parked after the last move.
    #[must_use]
    pub fn is_parked(&self) -> bool {
        self.is_parked
    }

    fn field(&self) -> f64 {
        let on_rail = Vector2::new(self.s_true + self.machine.a, self.machine.b);
        let over_bed = Rotation2::new(self.bed_true) * on_rail;
        let of_one = |at: &Vector2<f64>| {
            let distance = (over_bed - at).norm();
            if distance >= FIELD_ENDS {
                return 0.0;
            }
            let place = distance / TABLE_STEP;
            let (below, share) = (place as usize, place.fract());
            self.table[below] + share * (self.table[below + 1] - self.table[below])
        };
        self.machine.magnets.iter().map(of_one).sum()
    }

    fn set_drive(&mut self, theta: f64) {
        self.drive = theta;
        self.bed_true = self.bed.drive(BedTurn::accumulated(theta + self.slipped)).radians();
    }

    /// Reads the digital sensor.
    fn watch(&mut self) -> bool {
        let field = self.field();
        let [on, off] = self.machine.switches;
        // Far from switching, noise does not matter and need not be drawn.
        let far = 8.0 * self.machine.noise;
        let seen = if (field - on).abs() > far && (field - off).abs() > far {
            field
        } else {
            field + self.chance.normal(self.machine.noise)
        };
        self.is_on = self.machine.is_stuck || if self.is_on { seen > off } else { seen > on };
        self.is_on
    }
}

impl Rig for SimulatedRig {
    fn home(&mut self) -> Result<(), RigError> {
        self.carriage_to(0.0)?;
        self.turn_to(0.0)
    }

    fn carriage_to(&mut self, s: f64) -> Result<(), RigError> {
        self.time += (s - self.s_told).abs() / 50.0 + 0.1;
        self.n_moves += 1;
        self.is_parked = false;
        self.s_told = s;
        let half = self.machine.rail_play / 2.0;
        self.s_true = self.s_true.clamp(s - half, s + half);
        self.watch();
        Ok(())
    }

    fn turn_to(&mut self, theta: f64) -> Result<(), RigError> {
        self.time += (theta - self.drive).abs() / self.machine.speed + 0.05;
        self.n_moves += 1;
        self.is_parked = false;
        self.set_drive(theta);
        self.watch();
        Ok(())
    }

    fn turn_until(&mut self, is_on: bool, theta: f64) -> Result<Option<f64>, RigError> {
        self.n_moves += 1;
        self.is_parked = false;
        let start = self.drive;
        let way = (theta - start).signum();
        let step = self.machine.speed / self.machine.rate;
        let n_steps = ((theta - start).abs() / step).ceil() as usize;
        for k in 1..=n_steps {
            let at = start + way * (step * k as f64).min((theta - start).abs());
            self.set_drive(at);
            let was_on = self.is_on;
            if self.watch() == is_on && was_on != is_on {
                self.time += (at - start).abs() / self.machine.speed;
                // The count is taken a little after the field was there.
                return Ok(Some(at + way * self.machine.speed * self.machine.delay));
            }
        }
        self.time += (theta - start).abs() / self.machine.speed;
        self.n_sweeps += 1;
        if let Some((after, by)) = self.machine.slips
            && self.n_sweeps == after
        {
            self.slipped += by;
        }
        Ok(None)
    }

    fn is_on(&mut self) -> Result<bool, RigError> {
        Ok(self.watch())
    }

    fn level(&mut self) -> Result<f64, RigError> {
        let field = self.field() + self.chance.normal(self.machine.noise);
        Ok((field.clamp(-SATURATES, SATURATES) / BIT).round() * BIT)
    }

    fn park(&mut self) -> Result<(), RigError> {
        self.is_parked = true;
        Ok(())
    }
}

/// A ring, and magnets elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Places round the ring.
    pub count: u32,
    /// mm.
    pub radius: f64,
    /// Centre of the ring from the axis, mm.
    pub centre: Vector2<f64>,
    /// Azimuth of the first magnet, radians.
    pub angle: f64,
    /// Places that are empty.
    pub missing: Vec<u32>,
    /// Further magnets: radius and azimuth from the ring's centre, mm and radians.
    pub others: Vec<[f64; 2]>,
    /// How well magnets are placed, each way, mm.
    pub placement: f64,
}

impl Layout {
    /// Returns where the magnets stand on the bed, mm from the axis.
    #[must_use]
    pub fn magnets(&self, chance: &mut Chance) -> Vec<Vector2<f64>> {
        let ring = (0..self.count)
            .filter(|place| !self.missing.contains(place))
            .map(|place| [self.radius, TAU * f64::from(place) / f64::from(self.count)]);
        ring.chain(self.others.iter().copied())
            .map(|[radius, azimuth]| {
                let angle = self.angle + azimuth;
                let miss =
                    Vector2::new(chance.normal(self.placement), chance.normal(self.placement));
                self.centre + radius * Vector2::new(angle.cos(), angle.sin()) + miss
            })
            .collect()
    }
}
