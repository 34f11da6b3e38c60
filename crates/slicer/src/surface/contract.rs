use super::*;

/// Points in a part from 0.5 to 40 mm about the axis and from 0 to 50 mm high.
pub(crate) fn samples() -> Vec<Point3<f64>> {
    (0..100)
        .map(|i| {
            let t = f64::from(i);
            let radius = 0.5 + 39.0 * (t * 0.618).fract();
            Point3::new(radius * (t * 0.7).sin(), radius * (t * 0.7).cos(), t * 0.5)
        })
        .collect()
}

/// Checks round trip, gradient, monotony, the axis, the convex form and the metric at `samples`.
pub(crate) fn check(surface: &dyn LayerSurface, samples: &[Point3<f64>]) {
    for p in samples {
        round_trip(surface, p);
        gradient(surface, p);
        form(surface, p);
        metric(surface, p);
        normals(surface, p);
        let height = surface.height(surface.level(p), p.xy().coords.norm());
        assert!((height - p.z).abs() < 1e-9, "{height} is not the height of {p}");
        assert!((surface.slope_cos(p) - surface.normal(p).z).abs() < 1e-12);
        let thickness = surface.thickness_per_level(p) * surface.gradient(p).norm();
        assert!((thickness - 1.0).abs() < 1e-12);
        let on_axis = Point3::new(0.0, 0.0, p.z);
        assert!((surface.level(&on_axis) - p.z).abs() < 1e-9, "the level is z on the axis");
        assert_eq!(surface.flatten(&on_axis), Point2::origin());
        let lifted = surface.lift(p.z, &Point2::origin());
        assert!((lifted - on_axis).norm() < 1e-9);
    }
}

fn round_trip(surface: &dyn LayerSurface, p: &Point3<f64>) {
    let back = surface.lift(surface.level(p), &surface.flatten(p));
    assert!((back - p).norm() < 1e-9, "{p} came back as {back}");
}

fn gradient(surface: &dyn LayerSurface, p: &Point3<f64>) {
    const STEP: f64 = 1e-4;
    let difference = Vector3::from_fn(|k, _| {
        let step = Vector3::ith(k, STEP);
        (surface.level(&(p + step)) - surface.level(&(p - step))) / (2.0 * STEP)
    });
    let gradient = surface.gradient(p);
    assert!((gradient - difference).norm() < 1e-5, "{gradient} is not {difference} at {p}");
    assert!(gradient.z > 0.0, "the level grows upwards at {p}");
}

fn form(surface: &dyn LayerSurface, p: &Point3<f64>) {
    let form = surface.form();
    let sign = if form.is_mirrored() { -1.0 } else { 1.0 };
    assert_eq!(surface.level(p), sign * form.value(&form.convex(p)), "one expression for both");
}

/// A short step along the layer is as long in the metric as in space.
fn metric(surface: &dyn LayerSurface, p: &Point3<f64>) {
    const STEP: f64 = 1e-3;
    let (level, uv) = (surface.level(p), surface.flatten(p));
    let chart = surface.chart(level);
    for direction in 0..8 {
        let (sin, cos) = (f64::from(direction) * 0.8).sin_cos();
        let to = uv + nalgebra::Vector2::new(cos, sin) * STEP;
        let in_space = (surface.lift(level, &to) - p).norm();
        let (length, distance) = (chart.length(&uv, &to), chart.distance(&uv, &to));
        assert!((length - in_space).abs() < 1e-7, "{length} is not {in_space} at {p}");
        assert!((distance - in_space).abs() < 1e-7, "{distance} is not {in_space} at {p}");
    }
    let radius = chart.radius(uv.coords.norm());
    assert!((radius - p.xy().coords.norm()).abs() < 1e-9);
}

/// Points are carried along the normal, to first order in the step.
fn normals(surface: &dyn LayerSurface, p: &Point3<f64>) {
    const STEP: f64 = 1e-4;
    let (level, uv) = (surface.level(p), surface.flatten(p));
    let gradient = surface.gradient(p);
    let expected = p + gradient * (STEP / gradient.norm_squared());
    let s = uv.coords.norm();
    let to = uv * (surface.carry(s, level, level + STEP) / s);
    let reached = surface.lift(level + STEP, &to);
    assert!((reached - expected).norm() < 1e-7, "{reached} is not {expected}");
}
