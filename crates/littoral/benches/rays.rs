//! Rays per second, on one thread and a fixed scene.
#![cfg_attr(rustfmt, rustfmt_skip)]
fn cpu()->f64{ let mut t=[0i64;2]; unsafe extern "C"{fn clock_gettime(c:i32,t:*mut i64)->i32;} unsafe{clock_gettime(2,t.as_mut_ptr());} t[0] as f64+t[1] as f64*1e-9 }
use littoral::field::*; use littoral::space::*; use littoral::raycast::*; use glam::*;
fn med(mut v:Vec<f64>)->f64{v.sort_by(|a,b|a.total_cmp(b));v[v.len()/2]}
fn main(){
 let n=4097usize; let path=std::env::var("LITTORAL_MAP").expect("map");
 let b=std::fs::read(path).unwrap(); let h:Vec<f32>=b.chunks_exact(4).map(|c|f32::from_le_bytes([c[0],c[1],c[2],c[3]])).collect();
 let s=30000.0/(n-1) as f64;
 let raster=Raster::new(n,n,DVec2::splat(s),h).unwrap();
 let land=Land::at(raster,DVec2::ZERO);
 let only=std::env::var("ONLY").unwrap_or_default();
 let simd=match std::env::var("SIMD").as_deref(){Ok("avx2")=>Simd::Avx2,Ok("portable")=>Simd::Portable,_=>Simd::best()};
 let want=|k:&str| only.is_empty()||only.contains(k);
 if want("build"){ for _ in 0..4{ let t=cpu(); let p=RangePyramid::new(land.raster()); println!("pyramid {:.1} ms", (cpu()-t)*1e3); std::hint::black_box(p);} }
 println!("{:.3} B/sample", land.bytes() as f64/(n*n) as f64);
 let hh=|x:f64,y:f64| land.raster().heights()[((y/s) as usize)*n+(x/s) as usize] as f64;
 for (name,f,up,pitch) in [("low",0.1,50.0,-5f64),("high",0.2,3000.0,-45.0)]{
  let o=DVec3::new(f*30000.,f*30000.,hh(f*30000.,f*30000.)+up); let (y,p)=(45f64.to_radians(),pitch.to_radians());
  let fw=DVec3::new(p.cos()*y.cos(),p.cos()*y.sin(),p.sin()); let r=DVec3::new(y.sin(),-y.cos(),0.); let u=r.cross(fw); let th=30f64.to_radians().tan(); let (w,ht)=(1920,1080);
  let dir=|px:usize,py:usize|{let a=(2.*(px as f64+0.5)/w as f64-1.)*th*w as f64/ht as f64; let b=(1.-2.*(py as f64+0.5)/ht as f64)*th; fw+r*a+u*b};
  if want("single"){
  let mut v=vec![]; let mut hits=0;let mut cnt=0; for _ in 0..3{ hits=0;cnt=0; let t=cpu(); for py in (0..ht).step_by(4){for px in 0..w{ cnt+=1; if land.first_hit(&Ray::new(o,dir(px,py))).is_some(){hits+=1;} }} v.push(cnt as f64/(cpu()-t)/1e6);}
  println!("{name}: single {:.2} Mray/s hit {:.1}%",med(v),100.*hits as f64/cnt as f64);}
  let rays:Vec<LocalRay>=(0..w*ht).map(|i|LocalRay::new(Vec3::ZERO,dir(i%w,i/w).as_vec3())).collect();
  let caster=land.caster(o).with_simd(simd);
  let mut d=vec![0f32;rays.len()];
  if want("view"){ let view=View::oriented(o,Mat3::from_cols(r.as_vec3(),u.as_vec3(),-fw.as_vec3()),60f32.to_radians(),UVec2::new(1920,1080));
   let mut v=vec![]; for _ in 0..7{let t=cpu(); caster.view_hits(&view,Vec2::splat(0.5),0..1080,&mut d); v.push(rays.len() as f64/(cpu()-t)/1e6);}
   let hits=d.iter().filter(|t|t.is_finite()).count(); let (c,rr,dd)=view.frame();
   let mut worst=0f64; let mut bad=0; for i in (0..rays.len()).step_by(61){ let q=c+rr*((i%w) as f32+0.5)+dd*((i/w) as f32+0.5); let a=land.first_hit(&Ray::new(o,q.as_dvec3())).map_or(f64::INFINITY,|h|h.distance); let e=if a.is_infinite()&&d[i].is_infinite(){0.}else{(a-d[i] as f64).abs()}; if e>0.05{bad+=1;}else{worst=worst.max(e);} }
   println!("{name}: view {:.2} Mray/s hit {:.1}% off {bad} worst {worst:.4}",med(v),100.*hits as f64/rays.len() as f64); }
  if want("stream"){ 
   let mut v=vec![]; for _ in 0..5{let t=cpu(); caster.first_hits(&rays,&mut d); v.push(rays.len() as f64/(cpu()-t)/1e6);} 
   let hits=d.iter().filter(|t|t.is_finite()).count();
   let mut worst=0f64; let mut bad=0; for i in (0..rays.len()).step_by(61){ let a=land.first_hit(&Ray::new(o,rays[i].direction.as_dvec3())).map_or(f64::INFINITY,|h|h.distance); let e=if a.is_infinite()&&d[i].is_infinite(){0.}else{(a-d[i] as f64).abs()}; if e>0.05{bad+=1;}else{worst=worst.max(e);} }
   println!("{name}: stream {:.2} Mray/s hit {:.1}% off by more than 5 cm {bad} of {}, else worst {worst:.4}",med(v),100.*hits as f64/rays.len() as f64,rays.len()/61);
   let sh:Vec<LocalRay>=rays.iter().zip(&d).filter(|(_,t)|t.is_finite()).map(|(r,t)|LocalRay::new(r.direction* *t+Vec3::Z*0.05,vec3(0.8,-0.5,0.343))).collect(); let mut any=vec![false;sh.len()];
   let mut v=vec![]; for _ in 0..5{let t=cpu(); caster.any_hits(&sh,&mut any); v.push(sh.len() as f64/(cpu()-t)/1e6);}
   println!("{name}: shadow {:.2} Mray/s blocked {:.2}%",med(v),100.*any.iter().filter(|x|**x).count() as f64/sh.len() as f64);
  }
 }
 let m=1_000_000; let mut st=88172645463325252u64; let mut next=move||{st^=st<<13;st^=st>>7;st^=st<<17;((st>>40) as f32)/(1u32<<24) as f32};
 if want("height"){ let at:Vec<DVec2>=(0..m).map(|_|dvec2(next() as f64*29999.,next() as f64*29999.)).collect(); let near:Vec<Vec2>=at.iter().map(|p|(*p-15000.).as_vec2()).collect(); let mut hs=vec![0f32;m];
  let mut v=vec![];let mut v2=vec![];let mut v3=vec![]; let c=land.caster(dvec3(15000.,15000.,0.)).with_simd(simd); for _ in 0..7{let t=cpu(); land.heights_at(&at,&mut hs); v.push(m as f64/(cpu()-t)/1e6); let t=cpu(); c.heights_at(&near,&mut hs); v2.push(m as f64/(cpu()-t)/1e6);let t=cpu(); for (p,h) in at.iter().zip(&mut hs){*h=land.height_at(*p).unwrap_or(f32::NAN);} v3.push(m as f64/(cpu()-t)/1e6);} println!("heights: bulk {:.1} relative {:.1} one by one {:.1} M/s",med(v),med(v2),med(v3)); }
 if want("sight"){ for (name,up) in [("2 m",2f32),("400 m",400.)]{ let anchor=dvec3(15000.,15000.,0.); let c=land.caster(anchor).with_simd(simd);
  let mut end=||{let (x,y)=(next()*29997.,next()*29997.); vec3(x-15000.,y-15000.,hh(x as f64,y as f64) as f32+up)}; let seg:Vec<[Vec3;2]>=(0..m).map(|_|[end(),end()]).collect(); let mut vis=vec![false;m];
  let rays:Vec<LocalRay>=seg.iter().map(|s|LocalRay::between(s[0],s[1])).collect(); let mut any=vec![false;m];
  let mut v=vec![];let mut v2=vec![]; for _ in 0..5{let t=cpu(); c.lines_of_sight(&seg,&mut vis); v.push(m as f64/(cpu()-t)/1e6); let t=cpu(); c.any_hits(&rays,&mut any); v2.push(m as f64/(cpu()-t)/1e6);}
  let diff=vis.iter().zip(&any).filter(|(a,b)|a==b).count(); println!("sight {name}: {:.2} M/s, as stream {:.2}, blocked {:.2}% differ {diff}",med(v),med(v2),100.*any.iter().filter(|x|**x).count() as f64/m as f64); } }
}
