//! Colours.

use machine::program::Role;

/// A colour in sRGB, 0 to 255.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Colour(pub(super) [u8; 3]);

/// Lines and letters that must be seen on white and on black.
pub(super) const INK: Colour = Colour([0x80, 0x88, 0x93]);

/// The rotation axis and what belongs to it.
pub(super) const AXIS: Colour = Colour([0xd8, 0x1e, 0x5b]);

/// Low, middle and high places of a print.
const HEIGHTS: [Colour; 5] = [
    Colour([0x3b, 0x4c, 0xa8]),
    Colour([0x2a, 0x82, 0xb8]),
    Colour([0x2f, 0xae, 0x9d]),
    Colour([0x9c, 0xcb, 0x62]),
    Colour([0xf6, 0xd5, 0x5c]),
];

impl Colour {
    /// Returns the colour as SVG writes it.
    pub(super) fn hex(self) -> String {
        let [r, g, b] = self.0;
        format!("#{r:02x}{g:02x}{b:02x}")
    }

    /// Returns a mixture with a share of `other`.
    pub(super) fn mixed(self, other: Self, share: f64) -> Self {
        let mix = |k: usize| {
            let (a, b) = (f64::from(self.0[k]), f64::from(other.0[k]));
            (a + (b - a) * share.clamp(0.0, 1.0)).round() as u8
        };
        Self([mix(0), mix(1), mix(2)])
    }

    /// Returns the colour in another light: 0 is black, 1 as it is, 2 white.
    pub(super) fn lit(self, light: f64) -> Self {
        if light <= 1.0 {
            Self([0, 0, 0]).mixed(self, light)
        } else {
            self.mixed(Self([255, 255, 255]), light - 1.0)
        }
    }
}

/// Returns the colour of a role.
pub(super) fn of_role(role: Role) -> Colour {
    Colour(match role {
        Role::ExternalPerimeter => [0xe8, 0x6a, 0x33],
        Role::Perimeter => [0xf2, 0xb1, 0x34],
        Role::OverhangPerimeter => [0x3d, 0x5a, 0xd9],
        Role::InternalInfill => [0x5b, 0x9b, 0xd0],
        Role::SolidInfill => [0x7d, 0x6b, 0xc4],
        Role::TopSolidInfill => [0x3f, 0xb6, 0x8b],
        Role::BridgeInfill => [0x2f, 0x8f, 0xa8],
        Role::Ironing => [0xc7, 0x6f, 0x5a],
        Role::GapFill => [0xd9, 0x6b, 0xa8],
        Role::SkirtBrim => [0x8a, 0xa3, 0x5c],
        Role::SupportMaterial => [0x4f, 0xa3, 0x5f],
        Role::SupportInterface => [0x2d, 0x7a, 0x45],
        Role::Custom => [0xa5, 0x9a, 0x8c],
    })
}

/// Returns the colour of a height, given as a share of the whole.
pub(super) fn of_height(share: f64) -> Colour {
    let place = share.clamp(0.0, 1.0) * (HEIGHTS.len() - 1) as f64;
    let below = (place.floor() as usize).min(HEIGHTS.len() - 2);
    HEIGHTS[below].mixed(HEIGHTS[below + 1], place - below as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_mix_and_shine() {
        let (black, white) = (Colour([0, 0, 0]), Colour([255, 255, 255]));
        assert_eq!(black.mixed(white, 0.5).hex(), "#808080");
        assert_eq!((INK.lit(0.0), INK.lit(1.0), INK.lit(2.0)), (black, INK, white));
        assert_eq!(
            (of_height(-1.0), of_height(0.5), of_height(9.0)),
            (HEIGHTS[0], HEIGHTS[2], HEIGHTS[4])
        );
    }
}
