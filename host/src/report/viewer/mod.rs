//! The viewer: map, objects, paths, pictures and charts of a run over a time line, inside one page
//! that fetches nothing.
//!
//! Meshes and tables are deflated and in base64, in elements that the page's script reads one after
//! the other; pictures are read when they are shown. Without WebGL 2 or scripts the page shows a
//! picture and says so.

mod clouds;
mod head;
mod values;

use crate::formats::bounds::MAX_DECODE_BYTES;
use crate::formats::{FormatError, read_bytes_within};
use crate::scene::{OVERVIEW, PICTURES_FOLDER, PictureKind, Scene, tiles};
use base64::{Engine, engine::general_purpose::STANDARD};
use flate2::{Compression, write::ZlibEncoder};
use head::ViewerIndex;
use maud::{Markup, PreEscaped, html};
use std::io;
use std::path::Path;
use values::SurfaceValues;

const STYLE: &str = include_str!("viewer.css");
/// The script in the order in which its parts rely on each other.
const SCRIPT: [&str; 8] = [
    include_str!("vector.js"),
    include_str!("decode.js"),
    include_str!("shaders.js"),
    include_str!("renderer.js"),
    include_str!("camera.js"),
    include_str!("pictures.js"),
    include_str!("charts.js"),
    include_str!("viewer.js"),
];

/// The viewer of a run folder, as a part of a page.
///
/// # Errors
/// The encoder fails.
pub fn fragment(folder: &Path, name: &str, scene: &Scene) -> Result<Markup, FormatError> {
    let failed = |source| FormatError::Read { path: folder.to_path_buf(), source };
    let values = SurfaceValues::new(scene);
    // Values are scaled over the whole scene, so that colours mean the same in every tile.
    let mut tiles = tiles::tiles(&scene.static_map, &values.of_static(&scene.static_map), None)
        .map_err(failed)?;
    for (at, object) in scene.objects.iter().enumerate() {
        tiles.extend(
            tiles::tiles(&object.mesh, &values.of_object(object), Some(at)).map_err(failed)?,
        );
    }
    let mut head = ViewerIndex::new(name, scene, values.heads());
    let mut elements = Vec::new();
    // Each tile is an element of its own, decoded when the page shows it.
    for (at, tile) in tiles.into_iter().enumerate() {
        elements.push((format!("dynvox-tile-{at}"), STANDARD.encode(&tile.bytes)));
        head.tiles.push(tile.head);
    }
    for (at, cloud) in clouds::clouds(scene).map_err(failed)?.into_iter().enumerate() {
        elements.push((format!("dynvox-cloud-{at}"), STANDARD.encode(&cloud.bytes)));
        head.clouds.push(cloud.head);
    }
    // The index comes last: it counts what was encoded.
    let head = deflated(&head).map_err(failed)?;
    Ok(html! {
        style { (PreEscaped(STYLE)) }
        (panels(folder))
        (data("dynvox-head", &STANDARD.encode(head)))
        @for (id, text) in &elements { (data(id, text)) }
        @for (id, text) in pictures(folder, scene) { (data(&id, &text)) }
        script { (PreEscaped(format!("(() => {{\n\"use strict\";\n{}}})();", SCRIPT.concat()))) }
    })
}

/// Bytes that a browser does not look at.
fn data(id: &str, text: &str) -> Markup {
    html! { script type="text/plain" id=(id) { (PreEscaped(text)) } }
}

fn deflated(head: &ViewerIndex<'_>) -> io::Result<Vec<u8>> {
    let mut out = ZlibEncoder::new(Vec::new(), Compression::default());
    serde_json::to_writer(&mut out, head)?;
    out.finish()
}

/// Pictures as they are in the run folder. One that is missing there is missing here.
fn pictures(folder: &Path, scene: &Scene) -> Vec<(String, String)> {
    let names = scene
        .pictures
        .frames
        .iter()
        .flat_map(|&frame| PictureKind::ALL.map(|kind| kind.file(frame)));
    names.filter_map(|name| Some((format!("dynvox-{name}"), picture(folder, &name)?))).collect()
}

fn picture(folder: &Path, name: &str) -> Option<String> {
    let path = folder.join(PICTURES_FOLDER).join(name);
    let bytes = read_bytes_within(&path, "a picture", MAX_DECODE_BYTES).ok()?;
    Some(STANDARD.encode(bytes))
}

/// Builds the page's panels, with the pictures that show without the script.
fn panels(folder: &Path) -> Markup {
    let overview = picture(folder, OVERVIEW);
    html! {
        div #dynvox-viewer .viewer {
            div.view {
                canvas tabindex="0" role="img" aria-label="map: drag to turn, wheel to zoom, right button or \
                    two fingers to move, W A S D Q E to fly" {}
                figure.still {
                    @if let Some(jpeg) = &overview { img alt="the finished map from behind and \
                        above" src={ "data:image/jpeg;base64," (jpeg) }; }
                    figcaption.reason { "The map as a picture: turning it needs a browser with \
                        scripts and WebGL 2." }
                }
                progress max="1" value="0" hidden {}
                details.controls open hidden {
                    summary.row { "layers and colours" }
                    div.row.layers {}
                    div.row {
                        label { "colour " select.colour {
                            option value="0" { "photo" }
                            option value="1" { "height" }
                            option value="2" { "normal" }
                            option value="3" { "state" }
                        } }
                        label { "view " select.mode {
                            option value="orbit" { "orbit" }
                            option value="fly" { "fly" }
                            option value="follow" { "follow the camera" }
                            option value="camera" { "through the camera" }
                        } }
                        button.reset type="button" { "reset" }
                    }
                }
                div.legend hidden { span.low {} i {} span.high {} }
                div.note {}
            }
            div.side hidden tabindex="0" role="region" aria-label="pictures" {
                figure { canvas.left role="img" aria-label="left image with masks and \
                    tracks" {} figcaption { "left image, masks and tracks" } }
                figure { img.disparity alt="disparity"; figcaption { "disparity" } }
                figure { img.map alt="the map from the camera's \
                                      pose"; figcaption { "map from the camera's pose" } }
            }
            div.time hidden {
                button.play type="button" aria-label="play" { "▶" }
                input.slider type="range" min="0" value="0" aria-label="frame";
                output {}
            }
            p.keys hidden {
                kbd { "Space" } " plays, " kbd { "←" } " " kbd { "→" } " step, " kbd { "F" }
                " fills the screen. On the map: drag turns, the wheel zooms, the right button or \
                 two fingers move, " kbd { "W A S D Q E" } " fly."
            }
            div.charts hidden {}
        }
    }
}
