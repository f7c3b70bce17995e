//! Rays per second, on one thread and a fixed scene.
fn cpu() -> f64 {
    let mut t = [0i64; 2];
    unsafe extern "C" {
        fn clock_gettime(c: i32, t: *mut i64) -> i32;
    }
    unsafe {
        clock_gettime(2, t.as_mut_ptr());
    }
    t[0] as f64 + t[1] as f64 * 1e-9
}
use glam::*;
use littoral::field::*;
use littoral::space::*;
fn main() {
    let n = 4097usize;
    let path = std::env::var("LITTORAL_MAP").expect("map");
    let b = std::fs::read(path).unwrap();
    let h: Vec<f32> = b.chunks_exact(4).map(|c| f32::from_le_bytes([c[0], c[1], c[2], c[3]])).collect();
    let s = 30000.0 / (n - 1) as f64;
    let raster = Raster::new(n, n, DVec2::splat(s), h).unwrap();
    for _ in 0..4 {
        let t = cpu();
        let p = RangePyramid::new(&raster);
        println!("pyramid {:.1} ms", (cpu() - t) * 1e3);
        std::hint::black_box(p);
    }
    let t = cpu();
    let land = Land::at(raster, DVec2::ZERO);
    println!("land {:.1} ms {:.3} B/sample", (cpu() - t) * 1e3, land.bytes() as f64 / (n * n) as f64);
    let hh = |x: f64, y: f64| land.raster().heights()[((y / s) as usize) * n + (x / s) as usize] as f64;
    for (name, f, up, pitch) in [("low", 0.1, 50.0, -5f64), ("high", 0.2, 3000.0, -45.0)] {
        let o = DVec3::new(f * 30000., f * 30000., hh(f * 30000., f * 30000.) + up);
        let (y, p) = (45f64.to_radians(), pitch.to_radians());
        let fw = DVec3::new(p.cos() * y.cos(), p.cos() * y.sin(), p.sin());
        let r = DVec3::new(y.sin(), -y.cos(), 0.);
        let u = r.cross(fw);
        let th = 30f64.to_radians().tan();
        let (w, ht) = (1920, 1080);
        let t = cpu();
        let mut hits = 0;
        let mut cnt = 0;
        for py in (0..ht).step_by(4) {
            for px in 0..w {
                let a = (2. * (px as f64 + 0.5) / w as f64 - 1.) * th * w as f64 / ht as f64;
                let b = (1. - 2. * (py as f64 + 0.5) / ht as f64) * th;
                let d = fw + r * a + u * b;
                cnt += 1;
                if land.first_hit(&Ray::new(o, d)).is_some() {
                    hits += 1;
                }
            }
        }
        let e = cpu() - t;
        println!("{name}: {:.2} Mray/s hit {:.1}%", cnt as f64 / e / 1e6, 100. * hits as f64 / cnt as f64);
    }
}
