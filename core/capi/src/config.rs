//! The configuration: a rig, and settings by their dotted keys.

use crate::{
    DynvoxInertialUnit, DynvoxRawRig, DynvoxStatus,
    given::{output, read},
    raw::defaults,
};
use core::{
    ffi::{CStr, c_char},
    fmt::{self, Write},
};
use dynvox_core::{Config, SetError, geometry::StereoRig};

/// Bytes of settings that a configuration holds.
pub const DYNVOX_SETTINGS_BYTES: usize = 2048;

/// Two identical pinhole cameras, rectified.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxRig {
    /// Focal length, px.
    pub focal_px: f64,
    /// Principal point, px from the centre of the upper left pixel.
    pub center_u_px: f64,
    /// Principal point, px from the centre of the upper left pixel.
    pub center_v_px: f64,
    /// Distance between the cameras, m.
    pub baseline_m: f64,
}

/// Everything a mapper can be told, beside its bounds: the defaults for a rig, and what
/// dynvox_config_set changed of them.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct DynvoxConfig {
    /// The cameras; where pairs are raw, the rectified ones.
    pub rig: DynvoxRig,
    /// Raw cameras, if dynvox_config_raw named them.
    pub raw: DynvoxRawRig,
    /// Inertial unit, if dynvox_config_inertial named one.
    pub inertial: DynvoxInertialUnit,
    /// Bytes of `settings` in use.
    pub settings_len: usize,
    /// Lines `key=value`, in the order they were set. Written by dynvox_config_set.
    pub settings: [u8; DYNVOX_SETTINGS_BYTES],
}

impl From<&StereoRig> for DynvoxRig {
    fn from(&StereoRig { focal_px, center_u_px, center_v_px, baseline_m }: &StereoRig) -> Self {
        Self { focal_px, center_u_px, center_v_px, baseline_m }
    }
}

impl DynvoxConfig {
    /// The defaults with all settings; refused where the lines are not what dynvox_config_set
    /// wrote.
    pub(crate) fn resolved(&self) -> Result<Config, DynvoxStatus> {
        let DynvoxRig { focal_px, center_u_px, center_v_px, baseline_m } = self.rig;
        let mut config =
            defaults(StereoRig { focal_px, center_u_px, center_v_px, baseline_m }, &self.raw)?;
        config.inertial = self.inertial.unit()?;
        let lines = self.settings.get(..self.settings_len).ok_or(DynvoxStatus::Config)?;
        let lines = core::str::from_utf8(lines).map_err(|_| DynvoxStatus::Config)?;
        for line in lines.split_terminator('\n') {
            let (key, value) = line.split_once('=').ok_or(DynvoxStatus::Config)?;
            config.set(key, value).map_err(|_| DynvoxStatus::Config)?;
        }
        Ok(config)
    }

    /// Appends `key=value`.
    fn append(&mut self, key: &str, value: &str) -> Result<(), DynvoxStatus> {
        let line = [key, "=", value, "\n"].into_iter().flat_map(str::bytes);
        let free = self.settings.get_mut(self.settings_len..).ok_or(DynvoxStatus::Config)?;
        let needed = key.len() + value.len() + 2;
        if free.len() < needed {
            return Err(DynvoxStatus::TooSmall);
        }
        free.iter_mut().zip(line).for_each(|(to, byte)| *to = byte);
        self.settings_len += needed;
        Ok(())
    }
}

/// Writes all defaults for a rig.
///
/// # Safety
/// `rig` is null or points to a rig, `config` is null or points to a configuration.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_config_default(
    rig: *const DynvoxRig,
    config: *mut DynvoxConfig,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let (rig, config) = match unsafe { (read(rig), output(config)) } {
        (Ok(rig), Ok(config)) => (rig, config),
        (Err(status), _) | (_, Err(status)) => return status,
    };
    // SAFETY: not null and aligned, as checked; of the right type, as promised.
    unsafe {
        config.write(DynvoxConfig {
            rig,
            raw: DynvoxRawRig::NONE,
            inertial: DynvoxInertialUnit::NONE,
            settings_len: 0,
            settings: [0; DYNVOX_SETTINGS_BYTES],
        })
    };
    DynvoxStatus::Ok
}

/// Sets one setting by its dotted key: dynvox_config_set(&config, "volume.voxel_size_m", "0.05").
/// Keys and values are those of a run's config.toml; choices stand without quotes. The time between
/// two frames is "tracking.frame_interval_s". Whether a value is in its range,
/// dynvox_config_problem says.
///
/// # Safety
/// `config` is null or points to a configuration from dynvox_config_default, `key` and `value` are
/// null or text that ends in a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_config_set(
    config: *mut DynvoxConfig,
    key: *const c_char,
    value: *const c_char,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let (mut changed, key, value) =
        match unsafe { (read(config.cast_const()), text(key), text(value)) } {
            (Ok(config), Ok(key), Ok(value)) => (config, key, value),
            (Err(status), ..) | (_, Err(status), _) | (_, _, Err(status)) => return status,
        };
    let mut resolved = match changed.resolved() {
        Ok(resolved) => resolved,
        Err(status) => return status,
    };
    match resolved.set(key, value) {
        Err(SetError::Key) => return DynvoxStatus::Unknown,
        Err(_) => return DynvoxStatus::Value,
        Ok(()) => {}
    }
    // Settings are stored line by line.
    if value.contains('\n') {
        return DynvoxStatus::Value;
    }
    if let Err(status) = changed.append(key, value) {
        return status;
    }
    // SAFETY: not null and aligned, as checked; of the right type, as promised.
    unsafe { config.write(changed) };
    DynvoxStatus::Ok
}

/// A caller's text.
///
/// # Safety
/// `text` is null or ends in a zero byte, and nothing writes to it for 'a.
unsafe fn text<'a>(text: *const c_char) -> Result<&'a str, DynvoxStatus> {
    if text.is_null() {
        return Err(DynvoxStatus::Null);
    }
    // SAFETY: not null; the rest is the caller's promise.
    unsafe { CStr::from_ptr(text) }.to_str().map_err(|_| DynvoxStatus::Value)
}

/// Writes the first problem of a configuration as text that ends in a zero byte, truncated to `len`
/// bytes; the empty text without a problem.
///
/// # Safety
/// `config` is null or points to a configuration, `text` is null or to `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dynvox_config_problem(
    config: *const DynvoxConfig,
    text: *mut c_char,
    len: usize,
) -> DynvoxStatus {
    // SAFETY: the caller's promise.
    let config = match unsafe { read(config) }.and_then(|config| config.resolved()) {
        Ok(config) => config,
        Err(status) => return status,
    };
    if text.is_null() {
        return DynvoxStatus::Null;
    }
    // One byte is for the zero at the end.
    let Some(most) = len.checked_sub(1) else { return DynvoxStatus::TooSmall };
    let mut truncated = Truncated { text, most, written: 0 };
    if let Some(problem) = config.validate().first() {
        let _ = write!(truncated, "{problem}");
    }
    let written = truncated.written;
    // SAFETY: at most `len - 1`.
    unsafe { text.add(written).write(0) };
    DynvoxStatus::Ok
}

/// The caller's text under construction; what is beyond its bytes is left out.
struct Truncated {
    text: *mut c_char,
    most: usize,
    written: usize,
}

impl Write for Truncated {
    fn write_str(&mut self, part: &str) -> fmt::Result {
        for byte in part.bytes().take(self.most - self.written) {
            // SAFETY: below `most`, which the caller of the function that made this answers for.
            unsafe { self.text.add(self.written).write(byte as c_char) };
            self.written += 1;
        }
        Ok(())
    }
}
