//! Keyframes: left image, disparity, map.

use super::image;
use crate::observe::Keyframe;
use crate::run::RunRecord;
use maud::{Markup, html};

pub fn section(run: &RunRecord) -> Markup {
    let pictures = &run.sections.keyframes;
    let composed = pictures.keyframes.iter().any(|keyframe| !keyframe.composed_jpeg.is_empty());
    html! {
        section {
            h2 { "Input, disparity and map" }
            p.soft.small {
                "Left image; disparity from far (blue) to near (red), dark where it is unknown; \
                 the static map from the camera's pose after "
                "this frame."
            }
            @if composed {
                p.soft.small {
                    "Last: the map with every object in its current pose, from a volume of its \
                     own: static ones blue, dynamic ones orange."
                }
            }
            @for keyframe in &pictures.keyframes { (figure(keyframe)) }
            @if !pictures.overview_jpeg.is_empty() {
                figure {
                    (image(&pictures.overview_jpeg, "map from behind and above"))
                    figcaption { "The finished map from behind and above the last camera" }
                }
            }
        }
    }
}

fn figure(keyframe: &Keyframe) -> Markup {
    let composed = !keyframe.composed_jpeg.is_empty();
    html! {
        figure {
            div class=(if composed { "four" } else { "three" }) {
                (image(&keyframe.input_jpeg, "left image"))
                (image(&keyframe.disparity_jpeg, "disparity"))
                (image(&keyframe.raycast_jpeg, "map"))
                @if composed { (image(&keyframe.composed_jpeg, "map with objects")) }
            }
            figcaption { "frame " (keyframe.frame) }
        }
    }
}
