//! How fast the nozzle is sped up along its path, by what it lays.

use machine::program::Role;

/// Accelerations that are wanted, mm/s²; 0 for as fast as the machine can.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Accelerations {
    /// Outer walls.
    pub external_perimeter: f64,
    /// Other walls.
    pub perimeter: f64,
    /// Sparse infill.
    pub infill: f64,
    /// Solid infill.
    pub solid_infill: f64,
    /// Solid infill seen from above.
    pub top_solid_infill: f64,
    /// Bridges and walls that hang over.
    pub bridge: f64,
    /// Everything that is laid on the first layer.
    pub first_layer: f64,
    /// Without extruding.
    pub travel: f64,
    /// All else, and what is 0 above.
    pub usual: f64,
}

impl Accelerations {
    /// Returns whether any is wanted.
    #[must_use]
    pub fn are_wanted(&self) -> bool {
        *self != Self::default()
    }

    /// Returns the acceleration of what lays material, mm/s².
    #[must_use]
    pub fn of(&self, role: Role, is_first_layer: bool) -> f64 {
        let wanted = match role {
            Role::ExternalPerimeter => or(self.external_perimeter, self.perimeter),
            Role::Perimeter => self.perimeter,
            Role::OverhangPerimeter | Role::BridgeInfill => self.bridge,
            Role::InternalInfill => self.infill,
            Role::SolidInfill => or(self.solid_infill, self.infill),
            Role::TopSolidInfill | Role::Ironing => {
                or(self.top_solid_infill, or(self.solid_infill, self.infill))
            }
            _ => 0.0,
        };
        let first = if is_first_layer { self.first_layer } else { 0.0 };
        self.limit(or(first, wanted))
    }

    /// Returns the acceleration of what does not, mm/s².
    #[must_use]
    pub fn of_travel(&self) -> f64 {
        self.limit(self.travel)
    }

    fn limit(&self, wanted: f64) -> f64 {
        or(or(wanted, self.usual), f64::INFINITY)
    }
}

fn or(wanted: f64, otherwise: f64) -> f64 {
    if wanted > 0.0 { wanted } else { otherwise }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_said_is_as_its_kin_or_as_usual() {
        let none = Accelerations::default();
        assert!(!none.are_wanted() && none.of(Role::Perimeter, true) == f64::INFINITY);
        let some = Accelerations {
            perimeter: 600.0,
            infill: 900.0,
            top_solid_infill: 500.0,
            first_layer: 300.0,
            usual: 1000.0,
            ..none
        };
        assert_eq!(some.of(Role::ExternalPerimeter, false), 600.0);
        assert_eq!(some.of(Role::SolidInfill, false), 900.0);
        assert_eq!(some.of(Role::TopSolidInfill, false), 500.0);
        assert_eq!(some.of(Role::TopSolidInfill, true), 300.0);
        assert_eq!([some.of(Role::SkirtBrim, false), some.of_travel()], [1000.0; 2]);
    }
}
