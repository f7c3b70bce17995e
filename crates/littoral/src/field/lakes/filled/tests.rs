use super::super::{InLake, Lakes};
use super::*;
use crate::field::Raster;

fn land(columns: usize, rows: usize, spacing: f64, f: impl Fn(f64, f64) -> f64) -> Land {
    let height = |i: usize| f((i % columns) as f64, (i / columns) as f64) as f32;
    let heights = (0..columns * rows).map(height).collect();
    Land::new(Raster::new(columns, rows, DVec2::splat(spacing), heights).expect("valid"))
}

/// A round bowl, 20 m deep and 400 m wide, in a plain at 50 m; `cut` lowers the bottom of a channel eastwards out of it.
fn bowl(cut: Option<f64>) -> Land {
    land(121, 121, 5.0, move |x, y| {
        let away = (x - 60.0).hypot(y - 60.0) * 5.0;
        let ground = 30.0 + (away / 200.0).powi(2).min(1.0) * 20.0;
        match cut {
            Some(sill) if x > 60.0 && (y - 60.0).abs() <= 1.0 => ground.min(sill.max(ground - 30.0)),
            _ => ground,
        }
    })
}

#[test]
fn a_bowl_is_filled_to_its_closed_form() {
    let bowl = bowl(None);
    let mut lakes = Lakes::none(&bowl);
    let filled = lakes.fill(&bowl, None, DVec2::new(30.0, -20.0), 45.0).expect("it holds");
    // A paraboloid: the shore where 20 (r / 200)² = 15, half the volume of its cylinder.
    let radius = 200.0 * (15.0f64 / 20.0).sqrt();
    let area = std::f64::consts::PI * radius * radius;
    assert!((filled.area / area - 1.0).abs() < 0.01, "{filled:?}");
    assert!((filled.volume / (0.5 * area * 15.0) - 1.0).abs() < 0.01, "{filled:?}");
    assert_eq!((filled.deepest, filled.voids_beside, filled.level), (15.0, 0, 45.0));
    let outlet = filled.outlet.expect("over the plain");
    assert_eq!((outlet.height, outlet.into_sea), (50.0, false));
    assert!((outlet.at.length() - 200.0).abs() < 7.5, "on the rim: {}", outlet.at);
    // Depths and the shore are those of the bilinear bed, between samples as well.
    for i in 0..4000 {
        let at = DVec2::from_angle(f64::from(i)) * (0.07 * f64::from(i));
        let bed = f64::from(bowl.height_at(at).expect("known"));
        let expected = (bed <= 45.0).then_some(InLake { level: 45.0, depth: (45.0 - bed) as f32, is_sounded: true });
        assert_eq!(lakes.at(&bowl, at), expected, "{at}");
        assert!((at.length() - radius).abs() < 0.3 || expected.is_some() == (at.length() < radius), "{at}");
    }
    assert!(lakes.levels().eq([45.0]));
}

#[test]
fn what_would_run_out_says_how_high_and_where() {
    let cut = bowl(Some(41.5));
    let mut lakes = Lakes::none(&cut);
    let Err(LakeError::Overflows { level, outlet }) = lakes.fill(&cut, None, DVec2::ZERO, 45.0) else {
        panic!("held by a rim with an outlet")
    };
    assert_eq!((level, outlet.height, outlet.into_sea), (45.0, 41.5, false));
    assert!(outlet.at.x > 100.0 && outlet.at.y.abs() <= 5.0, "in the channel: {}", outlet.at);
    let words = LakeError::Overflows { level, outlet }.to_string();
    assert!(words.contains("41.50 m") && words.contains("got 45.00 m") && words.contains("beyond the data"), "{words}");
    assert!(LakeError::Overflows { level, outlet }.stretched(2.0).to_string().contains("83.00 m"));
    assert_eq!(lakes, Lakes::none(&cut), "nothing was filled");
    // Just at the sill water runs; below it, it stands.
    assert!(matches!(lakes.fill(&cut, None, DVec2::ZERO, 41.5), Err(LakeError::Overflows { .. })));
    assert_eq!(lakes.fill(&cut, None, DVec2::ZERO, 41.4).map(|lake| lake.outlet), Ok(Some(outlet)));
}

#[test]
fn lakes_are_named_where_they_can_lie() {
    // Two bowls in a plain at 10 m, a sea in the west, a void in the north-east.
    let land = land(81, 41, 10.0, |x, y| match () {
        _ if x > 76.0 && y > 36.0 => f64::NAN,
        _ if x < 8.0 => -5.0,
        _ => [(30.0, 20.0), (60.0, 20.0)].iter().map(|(a, b)| 0.6 * (x - a).hypot(y - b)).fold(10.0, f64::min) - 6.0,
    });
    let world = |x: f64, y: f64| land.origin() + 10.0 * DVec2::new(x, y);
    let sea = Water::flood(&land, 0.0).expect("in the west");
    let sea = Some(&sea);
    let mut lakes = Lakes::none(&land);
    let mut fill = |x, y, level| lakes.fill(&land, sea, world(x, y), level);
    assert!(matches!(fill(78.0, 38.0, 1.0), Err(LakeError::NoGround { .. })));
    assert!(matches!(fill(-5.0, 3.0, 1.0), Err(LakeError::NoGround { .. })));
    assert!(matches!(fill(f64::NAN, 3.0, 1.0), Err(LakeError::NoGround { .. })));
    assert_eq!(fill(45.0, 20.0, 2.5), Err(LakeError::Dry { level: 2.5, ground: 3.0 }));
    assert!(matches!(fill(30.0, 20.0, f64::NAN), Err(LakeError::Dry { .. })));
    assert_eq!(fill(3.0, 20.0, 1.0), Err(LakeError::InSea { level: 0.0 }));
    let Err(LakeError::Overflows { outlet, .. }) = fill(30.0, 20.0, 5.0) else { panic!("held by a plain at 4 m") };
    assert!(outlet.height == 4.0, "{outlet:?}");
    assert_eq!(fill(30.0, 20.0, 2.8).map(|lake| lake.outlet.map(|outlet| outlet.height)), Ok(Some(4.0)));
    // The bowls join at 3 m.
    assert_eq!(fill(60.0, 20.0, 3.2), Err(LakeError::Meets { level: f64::from(2.8f32) }));
    assert!(fill(60.0, 20.0, 2.5).is_ok());
    assert!(lakes.levels().eq([2.8f32, 2.5].map(f64::from)));
}

#[test]
fn the_sea_is_an_outlet_and_a_drowned_hollow_is_no_lake_of_its_own() {
    // A level lake at 20 m behind a bar of 26 m, beyond which the sea lies.
    let bay = land(80, 40, 10.0, |x, y| match () {
        _ if x < 10.0 && y > 2.0 && y < 37.0 => -4.0,
        _ if x < 28.0 && (y - 20.0).abs() < 3.0 => {
            if x < 12.0 {
                26.0
            } else {
                20.0
            }
        }
        _ => (20.0 + 1.2 * ((x - 40.0).hypot(y - 20.0) - 12.0).max(0.0)).min(60.0),
    });
    let sea = Water::flood(&bay, 0.0).expect("in the west");
    let mut lakes = Lakes::find(&bay, Some(&sea)).expect("the level hollow");
    assert!(lakes.levels().eq([20.0]));
    let seed = DVec2::ZERO;
    assert!(!lakes.at(&bay, seed).expect("a lake").is_sounded);
    let Err(LakeError::Overflows { outlet, .. }) = lakes.fill(&bay, Some(&sea), seed, 30.0) else { panic!("held") };
    assert_eq!((outlet.height, outlet.into_sea), (26.0, true));
    let filled = lakes.fill(&bay, Some(&sea), seed, 24.0).expect("below the bar");
    assert_eq!(filled.deepest, 4.0);
    assert!(lakes.levels().eq([24.0]), "the level hollow is under it");
    assert_eq!(lakes.at(&bay, seed), Some(InLake { level: 24.0, depth: 4.0, is_sounded: true }));
    // Without the sea the bar is no shore, and the water runs out over it to the border.
    assert!(matches!(
        Lakes::none(&bay).fill(&bay, None, seed, 30.0),
        Err(LakeError::Overflows { outlet: Outlet { height: 26.0, into_sea: false, .. }, .. })
    ));
}

#[test]
fn where_the_data_end_in_voids_a_shore_holds_and_a_valley_runs_out() {
    // A bed that was sounded as far as its shore, and nothing else.
    let sounded = land(101, 101, 5.0, |x, y| {
        let away = (x - 50.0).hypot(y - 50.0) / 40.0;
        if away > 1.0 { f64::NAN } else { 100.0 - 30.0 * (1.0 - away * away) }
    });
    let mut lakes = Lakes::none(&sounded);
    let filled = lakes.fill(&sounded, None, DVec2::ZERO, 100.2).expect("as far as its shore");
    assert!(filled.voids_beside > 200 && filled.outlet.is_none(), "{filled:?}");
    assert!((filled.deepest - 30.2).abs() < 1e-4);
    // Water that stands deep where the data end runs out there, at the height of the lowest ground beside them.
    assert!(matches!(
        Lakes::none(&sounded).fill(&sounded, None, DVec2::ZERO, 130.0),
        Err(LakeError::Overflows { outlet: Outlet { into_sea: false, .. }, .. })
    ));
    let valley = land(61, 61, 5.0, |x, y| match () {
        _ if !(6.0..=54.0).contains(&x) || !(6.0..=54.0).contains(&y) => f64::NAN,
        _ => 50.0 + 2.0 * (x - 30.0).abs() + 0.1 * (y - 30.0).abs(),
    });
    let Err(LakeError::Overflows { outlet, .. }) = Lakes::none(&valley).fill(&valley, None, DVec2::ZERO, 60.0) else {
        panic!("held by nothing")
    };
    assert!((outlet.height - 52.4).abs() < 1e-4, "{outlet:?}");
    let held = Lakes::none(&valley).fill(&valley, None, DVec2::ZERO, 52.0).expect("below that");
    assert_eq!((held.outlet, held.voids_beside), (Some(outlet), 0));
}

#[test]
fn there_is_an_end_to_them() {
    let dimples = land(140, 5, 1.0, |x, y| if y == 2.0 && x as i64 % 4 == 2 { 0.0 } else { 1.0 });
    let mut lakes = Lakes::none(&dimples);
    let filled = |k: usize, lakes: &mut Lakes| {
        lakes.fill(&dimples, None, dimples.origin() + DVec2::new(4.0 * k as f64 + 2.0, 2.0), 0.5).map(|lake| lake.area)
    };
    for k in 0..Lakes::MOST_FILLED {
        assert_eq!(filled(k, &mut lakes), Ok(1.0));
    }
    assert_eq!(filled(Lakes::MOST_FILLED, &mut lakes), Err(LakeError::TooMany));
    let last = dimples.origin() + DVec2::new(4.0 * (Lakes::MOST_FILLED - 1) as f64 + 2.0, 2.25);
    assert_eq!(lakes.at(&dimples, last).map(|lake| (lake.level, lake.depth)), Some((0.5, 0.25)));
}

/// Which samples are no higher than a level and joined to one of them: sample by sample, as one would say it.
fn flood(land: &Land, from: usize, level: f64) -> Vec<bool> {
    let raster = land.raster();
    let (columns, rows) = (raster.columns(), raster.rows());
    let mut wet = vec![false; columns * rows];
    let mut queue = vec![from];
    while let Some(i) = queue.pop() {
        if wet[i] || raster.voids().is_void(i) || f64::from(raster.heights()[i]) > level {
            continue;
        }
        wet[i] = true;
        let (column, row) = (i % columns, i / columns);
        for r in row.saturating_sub(1)..(row + 2).min(rows) {
            queue.extend((column.saturating_sub(1)..(column + 2).min(columns)).map(|c| r * columns + c));
        }
    }
    wet
}

#[test]
fn it_fills_what_a_flood_sample_by_sample_does() {
    let mut state = 88_172_645_463_325_252u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let (mut held, mut ran, mut beside, mut endless, mut shore, mut away) = (0, 0, 0, 0, 0, 0);
    for round in 0..2500 {
        let (columns, rows) = (3 + (next() * 14.0) as usize, 3 + (next() * 14.0) as usize);
        let (voids, fine) = (if next() < 0.5 { 0.0 } else { 0.5 * next() }, 1.0 + (6.0 * next()).floor());
        let heights: Vec<f32> = (0..columns * rows)
            .map(|i| {
                let border = [0, columns - 1].contains(&(i % columns)) || [0, rows - 1].contains(&(i / columns));
                if border && round % 8 == 0 {
                    return f32::NAN;
                }
                // Few different heights, so that there are levels and ties; borders are higher, or void.
                let height = ((next() - 0.5) * fine).round() + if border { 2.0 } else { 0.0 };
                if next() < voids * if border { 2.0 } else { 1.0 } { f32::NAN } else { height }
            })
            .collect();
        let Ok(raster) = Raster::new(columns, rows, DVec2::new(2.0, 3.0), heights) else { continue };
        let land = Land::new(raster);
        let border = |i: &usize| [0, columns - 1].contains(&(i % columns)) || [0, rows - 1].contains(&(i / columns));
        let place = DVec2::new(f64::from(next()), f64::from(next())) * land.extent() + land.origin();
        let level = f64::from((next() - 0.3) * 4.0);
        let Some(ground) = land.height_at(place).map(f64::from) else { continue };
        let mut lakes = Lakes::none(&land);
        let answer = lakes.fill(&land, None, place, level);
        if ground > level {
            assert_eq!(answer, Err(LakeError::Dry { level, ground }));
            continue;
        }
        let p = ((place - land.origin()) / land.raster().spacing()).floor();
        let corner = p.y as usize * columns + p.x as usize;
        let from = [corner, corner + 1, corner + columns, corner + columns + 1]
            .into_iter()
            .min_by(|&a, &b| land.raster().heights()[a].total_cmp(&land.raster().heights()[b]))
            .expect("four");
        let wet = flood(&land, from, level);
        // The lowest level, of those of samples, from which a flood gets to the border.
        let is_void = |i: usize| land.raster().voids().is_void(i);
        let around = |i: usize| {
            let (c, r) = (i % columns, i / columns);
            (r.saturating_sub(1)..(r + 2).min(rows))
                .flat_map(move |r| (c.saturating_sub(1)..(c + 2).min(columns)).map(move |c| r * columns + c))
        };
        // Voids in one piece with the edge.
        let mut edge: Vec<bool> = (0..wet.len()).map(|i| is_void(i) && border(&i)).collect();
        while let Some(i) = (0..wet.len()).find(|&i| is_void(i) && !edge[i] && around(i).any(|j| edge[j])) {
            edge[i] = true;
        }
        let by_void = |i: usize| around(i).any(|j| edge[j]);
        let runs = |level: &f64| (0..columns * rows).filter(border).any(|i| flood(&land, from, *level)[i]);
        let gets_to_void = |level: &f64| {
            let wet = flood(&land, from, *level);
            (0..wet.len()).any(|i| wet[i] && by_void(i))
        };
        let valid = (0..columns * rows).filter(|&i| !is_void(i));
        let mut levels: Vec<f64> = valid.map(|i| f64::from(land.raster().heights()[i])).collect();
        levels.sort_by(f64::total_cmp);
        let (sill, brink) = (levels.iter().copied().find(runs), levels.iter().copied().find(gets_to_void));
        let over = |sill: Option<f64>| sill.is_some_and(|sill| sill <= level);
        let depth = |i: usize| level - f64::from(land.raster().heights()[i]);
        let deepest = (0..wet.len()).filter(|&i| wet[i]).map(depth).fold(0.0, f64::max);
        let by_voids: Vec<usize> = (0..wet.len()).filter(|&i| wet[i] && by_void(i)).collect();
        let deep = by_voids.iter().filter(|&&i| depth(i) > 1.5f64.max(0.05 * deepest)).count();
        let is_deep = deep as f64 > 0.35 * by_voids.len() as f64;
        match answer {
            Ok(filled) => {
                held += 1;
                endless += usize::from(filled.outlet.is_none());
                shore += usize::from(over(brink));
                assert!(!(over(sill) || over(brink) && is_deep));
                assert!((0..wet.len()).all(|i| wet[i] == (lakes.samples()[i] > 0)));
                let first = [sill, brink].into_iter().flatten().filter(|sill| *sill > level).min_by(f64::total_cmp);
                assert_eq!(filled.outlet.map(|outlet| outlet.height), first);
                let near = |i: &usize| is_void(*i) && around(*i).any(|i| wet[i]);
                assert_eq!(filled.voids_beside, (0..wet.len()).filter(near).count());
                beside += usize::from(filled.voids_beside > 0);
            }
            Err(LakeError::Overflows { outlet, .. }) => {
                ran += 1;
                assert!(over(sill) || over(brink) && is_deep);
                assert_eq!(Some(outlet.height), if over(sill) { sill } else { brink });
                away += usize::from(!over(sill));
                let at = (outlet.at - land.origin()) / land.raster().spacing();
                assert_eq!(f64::from(land.raster().heights()[at.y as usize * columns + at.x as usize]), outlet.height);
            }
            Err(error) => panic!("{error}"),
        }
    }
    let counts = [held, ran, beside, endless, shore, away];
    assert!(counts.iter().all(|&count| count >= 5) && held > 100 && ran > 100, "{counts:?}");
}
