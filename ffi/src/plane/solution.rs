//! A plane scene under one light, solved.

use super::coupling::{blik_plane_coupling, classes};
use super::types::*;
use super::{Lanes, lane_bytes, part};
use crate::memory::*;
use crate::run::{Runner, Start, blik_run};
use crate::status::*;
use crate::types::{Place, Sized_, read, sized};
use crate::{call, caught};
use blik_kernel::arena::{ALIGNMENT, Arena, Need};
use blik_kernel::plane::Vec2;
use blik_kernel::plane::direct;
use blik_kernel::plane::image::Solved;
use blik_kernel::plane::light::{Capture, Light, MAX_JUMPS, PlaneSun, RadianceOf, Sky};
use blik_kernel::plane::solve::{Relaxed, System};
use core::ffi::c_void;
use core::sync::atomic::{AtomicBool, Ordering};

/// A solved plane scene in memory. Any number of threads may use it at once.
pub struct blik_plane_solution {
    tag: usize,
    pub(super) coupling: &'static blik_plane_coupling,
    light: Light<'static>,
    sky: Option<&'static Asked>,
    radiance: &'static [f64],
    relaxed: Relaxed,
    bytes: usize,
    #[cfg(feature = "std")]
    owner: Option<std::boxed::Box<Owned>>,
}

impl Handle for blik_plane_solution {
    const TAG: usize = 0x5ce9_e013;

    fn tag(at: *mut Self) -> *mut usize {
        // SAFETY: only the place is computed, within memory of a handle's size.
        unsafe { &raw mut (*at).tag }
    }

    #[cfg(feature = "std")]
    fn owner(&mut self) -> &mut Option<std::boxed::Box<Owned>> {
        &mut self.owner
    }
}

impl blik_plane_solution {
    pub(super) fn solved(&self) -> Solved<'_> {
        let settings = &self.coupling.base.settings;
        Solved {
            scene: &self.coupling.base.scene,
            light: &self.light,
            radiance: self.radiance,
            max_bounces: settings.max_bounces,
            cutoff: settings.cutoff,
        }
    }

    /// Directions at which what a mirrored ray sees jumps.
    pub(super) fn cuts(&self) -> usize {
        self.light.cuts().len()
    }

    /// Refuses a sky that has been seen to return what it must not.
    pub(super) fn check_sky(&self) -> Result<(), blik_error> {
        self.sky.map_or(Ok(()), Asked::check)
    }

    /// Diffuse radiances of all unknowns, all reflections that count.
    pub(super) fn radiances(&self) -> &[f64] {
        let unknowns = self.coupling.base.scene.unknowns();
        self.radiance.get(self.radiance.len().saturating_sub(unknowns)..).unwrap_or_default()
    }
}

/// The caller's sky, and whether it ever returned what it must not.
struct Asked {
    ask: unsafe extern "C" fn(user: *mut c_void, x: f64, y: f64) -> f64,
    user: *mut c_void,
    wrong: AtomicBool,
}

// SAFETY: the caller promises a function that any number of threads may call at once.
unsafe impl Sync for Asked {}

impl Asked {
    fn radiance(&self, direction: Vec2) -> f64 {
        // SAFETY: the caller's function, with the caller's pointer.
        let value = unsafe { (self.ask)(self.user, direction.x, direction.y) };
        if (0.0..=1e37).contains(&value) {
            return value;
        }
        self.wrong.store(true, Ordering::Relaxed);
        0.0
    }

    fn check(&self) -> Result<(), blik_error> {
        if self.wrong.load(Ordering::Relaxed) {
            return Err(blik_error::of(BLIK_ERROR_RANGE).field(BLIK_FIELD_SKY_RADIANCE).at(0, 0, f64::NAN));
        }
        Ok(())
    }
}

/// The sky that asks the caller.
fn asking(sky: &'static Asked) -> impl Fn(Vec2) -> f64 + Sync {
    move |direction| sky.radiance(direction)
}

/// Radiance by direction of a scene without a sky: 0.
const DARK: RadianceOf<'static> = &|_| 0.0;

/// The caller's light, its arrays still the caller's.
struct Given<'a> {
    sky: Option<blik_plane_sky>,
    jumps: &'a [f64],
    sun: Option<PlaneSun>,
}

impl Given<'_> {
    /// # Safety
    /// As for [`read`]; the jumps are as many as the struct says.
    unsafe fn new<'a>(light: *const blik_plane_light) -> Result<Given<'a>, blik_error> {
        // SAFETY: by the caller's promise.
        let light = unsafe { read(light) }?;
        let (mut given, mut sun) = (Given { sky: None, jumps: &[], sun: None }, None);
        // SAFETY: by the caller's promise.
        unsafe {
            if !light.sky.is_null() {
                let sky = read(light.sky)?;
                if sky.jump_count > MAX_JUMPS {
                    let error = blik_error::of(BLIK_ERROR_TOO_MANY).field(BLIK_FIELD_SKY_TABLE);
                    return Err(error.sizes(MAX_JUMPS, sky.jump_count));
                }
                given.jumps = input(sky.jumps, 2 * sky.jump_count)?;
                given.sky = Some(sky);
            }
            if !light.sun.is_null() {
                sun = Some(read(light.sun)?);
            }
        }
        given.sun = sun.map(|sun| {
            let half_angle = sun.capture_half_angle;
            let usual = Capture::conserving(sun.irradiance, half_angle);
            let radiance = if sun.capture_radiance < 0.0 { usual.radiance } else { sun.capture_radiance };
            let capture = (half_angle != 0.0).then_some(Capture { half_angle, radiance });
            PlaneSun { direction: Vec2::from(sun.direction), irradiance: sun.irradiance, capture }
        });
        given.kernel(DARK, &mut [Vec2::ZERO; MAX_JUMPS])?;
        Ok(given)
    }

    /// The kernel's light, checked, with its jumps in `jumps`.
    fn kernel<'a>(&self, ask: RadianceOf<'a>, jumps: &'a mut [Vec2]) -> Result<Light<'a>, blik_error> {
        let (pairs, _) = self.jumps.as_chunks::<2>();
        jumps.iter_mut().zip(pairs).for_each(|(to, pair)| *to = Vec2::from(*pair));
        let jumps = jumps.get(..pairs.len()).unwrap_or_default();
        let sky = match &self.sky {
            None => Sky::Uniform(0.0),
            Some(sky) if sky.radiance_of.is_none() => Sky::Uniform(sky.radiance),
            Some(_) => Sky::Varying { radiance: ask, jumps },
        };
        Ok(Light::new(sky, self.sun)?)
    }

    fn cuts(&self) -> Result<usize, blik_error> {
        Ok(self.kernel(DARK, &mut [Vec2::ZERO; MAX_JUMPS])?.cuts().len())
    }
}

/// Bytes of what stays, and of what solving needs besides.
fn parts(coupling: &blik_plane_coupling) -> Result<(usize, usize), blik_error> {
    let unknowns = coupling.base.scene.unknowns();
    let all = unknowns.saturating_mul(classes(coupling.base));
    // jumps, the caller's sky and the closure that asks it
    let kept = Need::new().and::<f64>(all).and::<f64>(2 * MAX_JUMPS).and::<u8>(size_of::<Asked>());
    let kept = kept.and::<u8>(size_of::<&Asked>()).bytes()?;
    Ok((kept, Need::new().and::<f64>(all).and::<f64>(unknowns).bytes()?))
}

/// Bytes with `lanes` lanes.
fn size(coupling: &blik_plane_coupling, given: &Given<'_>, lanes: usize) -> Result<usize, blik_error> {
    let (kept, work) = parts(coupling)?;
    let scratch = lane_bytes(&coupling.base.scene, given.cuts()?)?.checked_mul(lanes);
    let sum = scratch
        .and_then(|s| s.checked_add(kept)?.checked_add(work)?.checked_add(head::<blik_plane_solution>()));
    sum.ok_or(blik_error::of(BLIK_ERROR_TOO_MANY).sizes(usize::MAX, 0))
}

/// Puts a value into the arena's memory, where it is never dropped.
fn stow<T: 'static>(arena: &mut Arena<'static>, value: T) -> Result<&'static T, blik_error> {
    const { assert!(align_of::<T>() <= ALIGNMENT) };
    let place = arena.take::<u8>(size_of::<T>())?.as_mut_ptr().cast::<T>();
    // SAFETY: room for a T, aligned, and of the caller's promise ours as long as the handle is in use.
    unsafe {
        place.write(value);
        Ok(&*place)
    }
}

fn build(
    coupling: &'static blik_plane_coupling,
    given: &Given<'_>,
    memory: &'static mut [u8],
    runner: &mut Runner,
) -> Result<*mut blik_plane_solution, blik_error> {
    let (needed, room) = (size(coupling, given, 1)?, memory.len());
    if room < needed {
        return Err(blik_error::of(BLIK_ERROR_BUFFER_TOO_SMALL).sizes(needed, room));
    }
    let (place, rest) = place::<blik_plane_solution>(memory)?;
    let short = blik_error::of(BLIK_ERROR_INTERNAL);
    let (kept, work) = parts(coupling)?;
    let (own, rest) = rest.split_at_mut_checked(kept).ok_or(short)?;
    let (work_memory, scratch) = rest.split_at_mut_checked(work).ok_or(short)?;
    let (mut arena, mut work_arena) = (Arena::new(own, kept)?, Arena::new(work_memory, work)?);
    let (scene, settings) = (&coupling.base.scene, &coupling.base.settings);
    let (unknowns, classes) = (scene.unknowns(), classes(coupling.base));
    let radiance = arena.take::<f64>(unknowns * classes)?;
    let jumps = arena.take::<[f64; 2]>(MAX_JUMPS)?.as_mut_ptr().cast::<Vec2>();
    const { assert!(size_of::<Vec2>() == 16 && align_of::<Vec2>() <= ALIGNMENT) };
    // SAFETY: a Vec2 is two f64 (checked above), and all are written.
    let jumps = unsafe { core::slice::from_raw_parts_mut(jumps, MAX_JUMPS) };
    let mut asked = None;
    let ask: RadianceOf<'static> = match given.sky.and_then(|s| Some((s.radiance_of?, s.user))) {
        None => DARK,
        Some((ask, user)) => {
            let sky = stow(&mut arena, Asked { ask, user, wrong: AtomicBool::new(false) })?;
            asked = Some(sky);
            stow(&mut arena, asking(sky))?
        }
    };
    let light = given.kernel(ask, jumps)?;
    let direct = work_arena.take::<f64>(unknowns * classes)?;
    let next = work_arena.take::<f64>(unknowns)?;
    let mut relaxed = Relaxed::default();
    if (0..unknowns).any(|u| reflects(coupling, u)) {
        fill_direct(coupling, &light, scratch, direct, runner)?;
        let system = System::new(scene, coupling.matrix, direct)?;
        let goal = settings.max_bounces.is_none().then_some(settings.solver);
        relaxed = system.solve(goal, radiance, next)?;
    }
    if let Some(asked) = asked {
        asked.check()?;
    }
    let handle = blik_plane_solution {
        tag: blik_plane_solution::TAG,
        coupling,
        light,
        sky: asked,
        radiance,
        relaxed,
        bytes: kept,
        #[cfg(feature = "std")]
        owner: None,
    };
    // SAFETY: `place` made room for it.
    unsafe { place.write(handle) };
    Ok(place.as_ptr())
}

/// Fills the table of direct light, one value for each unknown and class.
fn fill_direct(
    coupling: &blik_plane_coupling,
    light: &Light<'_>,
    scratch: &mut [u8],
    direct: &mut [f64],
    runner: &mut Runner,
) -> Result<(), blik_error> {
    let (scene, rows) = (&coupling.base.scene, coupling.base.settings.rows());
    let (classes, cuts) = (classes(coupling.base), light.cuts().len());
    let lanes = Lanes::new(scratch, lane_bytes(scene, cuts)?, runner)?;
    let start = Start(direct.as_mut_ptr());
    lanes.rows(scene.unknowns(), 1.0, (scene, cuts), runner, &|range, scratch| {
        let open = coupling.open.get(range.start * classes..range.end * classes).unwrap_or_default();
        // SAFETY: ranges are disjoint and within the unknowns.
        let out = unsafe { part(&start, &range, classes) };
        Ok(direct::fill(scene, light, &rows, range, open, out, scratch)?)
    })
}

/// Whether an unknown reflects anything diffusely.
fn reflects(coupling: &blik_plane_coupling, unknown: usize) -> bool {
    let scene = &coupling.base.scene;
    let (primitive, _) = scene.unknown(unknown);
    scene.primitives().get(primitive).is_some_and(|p| scene.diffuse(p.material) > 0.0)
}

/// Numbers of a plane solution.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct blik_plane_solution_info {
    /// Size of this struct.
    pub struct_size: usize,
    /// Contraction of a sweep over the linear system.
    pub contraction: f64,
    /// Bound on the solver's error of all radiances: certain where the contraction is below 1, else by the sweeps' decay.
    pub solver_error: f64,
    /// Sweeps made.
    pub sweeps: u32,
    /// Bytes in use.
    pub bytes: usize,
}

impl Default for blik_plane_solution_info {
    fn default() -> blik_plane_solution_info {
        let struct_size = size_of::<blik_plane_solution_info>();
        blik_plane_solution_info { struct_size, contraction: 0.0, solver_error: 0.0, sweeps: 0, bytes: 0 }
    }
}
sized!(blik_plane_solution_info);

/// Bytes of memory with which [`blik_plane_solution_init`] keeps all lanes of `run` busy.
///
/// - `coupling`: the coupling
/// - `light`: the light
/// - `bytes`: receives the bytes; less is for fewer lanes
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_solution_size(
    coupling: *const blik_plane_coupling,
    light: *const blik_plane_light,
    run: *const blik_run,
    error: *mut blik_error,
    bytes: *mut usize,
) -> blik_status {
    call(error, || {
        let to = needed(bytes)?;
        // SAFETY: by the caller's promise.
        let (coupling, given, runner) = unsafe { (object(coupling)?, Given::new(light)?, Runner::new(run)?) };
        let size = size(coupling, &given, runner.lanes())?;
        // SAFETY: not null.
        unsafe { to.write(size) };
        Ok(())
    })
}

/// Lights a plane scene and solves for its diffuse radiance in the caller's memory. A solution whose sky ever returned what
/// is not finite, below 0 or above 1e37 refuses that call and all later ones.
///
/// - `coupling`: the coupling, which must outlive the solution
/// - `light`: the light, whose sky's function must outlive the solution
/// - `solution`: receives the solution
///
/// # Safety
/// Pointers are null or valid; nobody else uses the memory while the solution is in use.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_solution_init(
    coupling: *const blik_plane_coupling,
    light: *const blik_plane_light,
    run: *const blik_run,
    memory: *mut c_void,
    size: usize,
    error: *mut blik_error,
    solution: *mut *mut blik_plane_solution,
) -> blik_status {
    call(error, || {
        let to = needed(solution)?;
        // SAFETY: by the caller's promise.
        let (coupling, given, mut runner, memory) =
            unsafe { (object(coupling)?, Given::new(light)?, Runner::new(run)?, bytes(memory, size)?) };
        let made = build(coupling, &given, memory, &mut runner)?;
        // SAFETY: not null.
        unsafe { to.write(made) };
        Ok(())
    })
}

/// Lights a plane scene and solves for its diffuse radiance in memory of its own.
///
/// - `coupling`: the coupling, which must outlive the solution
/// - `light`: the light, whose sky's function must outlive the solution
/// - `solution`: receives the solution; to be ended by [`blik_plane_solution_destroy`]
///
/// # Safety
/// Pointers are null or valid, arrays as long as the structs say.
#[cfg(feature = "std")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_solution_create(
    coupling: *const blik_plane_coupling,
    light: *const blik_plane_light,
    run: *const blik_run,
    error: *mut blik_error,
    solution: *mut *mut blik_plane_solution,
) -> blik_status {
    call(error, || {
        let to = needed(solution)?;
        // SAFETY: by the caller's promise.
        let (coupling, given, mut runner) =
            unsafe { (object(coupling)?, Given::new(light)?, Runner::new(run)?) };
        let mut slab = Slab::new(size(coupling, &given, runner.lanes())?)?;
        // SAFETY: the handle owns the slab, or is never made.
        let made = build(coupling, &given, unsafe { slab.bytes_mut() }, &mut runner)?;
        // SAFETY: just made, and not null.
        unsafe {
            (*made).owner = Some(std::boxed::Box::new(Owned(std::vec![slab])));
            to.write(made);
        }
        Ok(())
    })
}

/// Ends a plane solution and frees what it owns.
///
/// - `solution`: the solution; null: nothing
///
/// # Safety
/// Null or a solution that nobody uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_solution_destroy(solution: *mut blik_plane_solution) {
    let _ = caught(|| {
        // SAFETY: by the caller's promise.
        unsafe { end(solution) };
        Ok(())
    });
}

/// Numbers of a plane solution.
///
/// - `solution`: the solution
/// - `info`: receives them; its `struct_size` is set before
///
/// # Safety
/// Pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn blik_plane_solution_get_info(
    solution: *const blik_plane_solution,
    error: *mut blik_error,
    info: *mut blik_plane_solution_info,
) -> blik_status {
    call(error, || {
        // SAFETY: by the caller's promise.
        let (to, handle): (_, &blik_plane_solution) = unsafe { (Place::new(info)?, object(solution)?) };
        to.write(blik_plane_solution_info {
            contraction: handle.relaxed.contraction,
            solver_error: handle.relaxed.error,
            sweeps: handle.relaxed.sweeps,
            bytes: handle.bytes,
            ..blik_plane_solution_info::default()
        });
        Ok(())
    })
}
