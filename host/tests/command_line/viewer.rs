//! The viewer of finished runs, in a browser where one is installed: it draws, scrubs and toggles,
//! without an error on the console.

use super::binary::{dynvox, output_text, rig};
use super::browser::{Visit, Window};
use super::run_folder::FakeRun;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Waits for the viewer, and what the steps of a test have in common.
const HELPERS: &str = r#"
const root = document.getElementById("dynvox-viewer"), canvas = root.querySelector(".view canvas"), data = root.dataset;
const until = async (done) => { while (!done()) await new Promise((resolve) => setTimeout(resolve, 20)); };
const drawn = async (change) => { const before = data.drawn; change(); await until(() => data.drawn !== before); };
const layer = (name) => root.querySelector(`.layers input[value=${name}]`);
const toggle = (name) => drawn(() => layer(name).click());
const scrub = (at) => drawn(() => {
  const slider = root.querySelector(".slider");
  slider.value = at;
  slider.dispatchEvent(new Event("input"));
});
const shown = () => {
  const gl = canvas.getContext("webgl2"), pixels = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let count = 0, red = 0;
  for (let at = 0; at < pixels.length; at += 4) {
    if ([0, 1, 2].some((channel) => Math.abs(pixels[at + channel] - pixels[channel]) > 6)) count++;
    red += pixels[at];
  }
  return { share: count / (pixels.length / 4), red };
};
await until(() => data.ready);
"#;

/// The page of a run folder.
fn viewer(folder: &Path) -> PathBuf {
    let made = dynvox(folder, &["view", ".", "--no-open"]);
    assert!(made.status.success(), "{}", output_text(&made));
    assert_eq!(String::from_utf8_lossy(&made.stdout).trim(), "./viewer.html");
    folder.join("viewer.html")
}

/// Runs a script on a page of a desktop's size and returns its report.
fn visit(page: &Path, before: &str, script: &str) -> serde_json::Value {
    let script = &[HELPERS, script].concat();
    Visit { page, part: "", window: Window::DESKTOP, before, script }.report()
}

#[test]
fn view_writes_one_file_that_fetches_nothing_and_refuses_what_is_no_run() {
    let root = TempDir::new().unwrap();
    FakeRun { frames: 4, objects: 1, squares: 20, pictures: true }.write(root.path());
    let page = fs::read_to_string(viewer(root.path())).unwrap();
    // No address, no file beside it, no style sheet from elsewhere.
    assert!(!page.contains("http") && !page.contains("src=\"/") && !page.contains("@import"));
    assert!(
        page.contains("<figcaption class=\"reason\">The map as a picture")
            && page.contains("data:image/jpeg;base64,"),
        "without scripts"
    );
    // A row that is no number.
    fs::write(root.path().join("frames.csv"), "frame\nx\n").unwrap();
    let damaged = dynvox(root.path(), &["view", ".", "--no-open"]);
    assert!(
        !damaged.status.success() && output_text(&damaged).contains("frames.csv cannot be used"),
        "{}",
        output_text(&damaged)
    );
    fs::remove_file(root.path().join("summary.json")).unwrap();
    let refused = dynvox(root.path(), &["view", ".", "--no-open"]);
    assert!(
        !refused.status.success() && output_text(&refused).contains("is not a run folder"),
        "{}",
        output_text(&refused)
    );
}

/// Scrubs through the frames, switches layers and colours, turns the view, and tells what each
/// changes.
const TOGGLES: &str = r#"
const all = shown(), result = { share: all.share, triangles: Number(data.triangles), error: data.error };
await scrub(0);
result.first = data.frame;
const caption = () => root.querySelector(".side figcaption").textContent;
result.caption = caption();
await scrub(11);
result.last = data.frame;
await until(() => caption() !== result.caption);
result.lastCaption = caption();
result.left = root.querySelector("canvas.left").width;
const plain = shown().red;
await toggle("swept");
result.swept = shown().red !== plain;
for (const name of ["pruned", "planning"]) {
  const without = shown().red;
  await toggle(name);
  result[name] = shown().red !== without;
  await toggle(name);
}
result.prunedName = layer("pruned").parentElement.textContent.trim();
await toggle("map");
result.objects = Number(data.triangles);
await toggle("later");
result.now = Number(data.triangles);
await toggle("map");
result.back = Number(data.triangles);
const photo = shown().red, select = root.querySelector(".colour");
result.colours = [...select.options].map((option) => option.textContent);
const legend = root.querySelector(".legend");
result.photoLegend = legend.hidden;
for (const value of ["1", "2", "3", "4", "5", "6"]) {
  await drawn(() => { select.value = value; select.dispatchEvent(new Event("change")); });
  result[`colour${value}`] = shown().red !== photo;
  result[`legend${value}`] = legend.hidden ? "" : [...legend.querySelectorAll("span")].map((end) => end.textContent).join(" to ");
}
const turn = (kind, x) => canvas.dispatchEvent(new PointerEvent(kind, {
  pointerId: 1, clientX: x, clientY: 200, buttons: 1, bubbles: true,
}));
canvas.setPointerCapture = () => {};
turn("pointerdown", 200);
const before = shown().red;
await drawn(() => turn("pointermove", 320));
result.turned = shown().red !== before;
report(result);
"#;

#[dynvox_needs::browser]
#[test]
fn the_viewer_draws_scrubs_and_toggles() {
    let root = TempDir::new().unwrap();
    FakeRun { frames: 12, objects: 2, squares: 60, pictures: true }.write(root.path());
    let of = visit(&viewer(root.path()), "", TOGGLES);
    assert!(of["share"].as_f64().unwrap() > 0.1, "the map is drawn: {of}");
    assert_eq!((&of["first"], &of["last"]), (&"0".into(), &"22".into()), "{of}");
    assert!(
        of["caption"].as_str().unwrap().ends_with("frame 0")
            && of["lastCaption"].as_str().unwrap().ends_with("frame 22"),
        "{of}"
    );
    assert_eq!(of["left"], 64, "{of}");
    let triangles = |key: &str| of[key].as_u64().unwrap();
    // The first object is last seen in the middle, the second at the end.
    assert_eq!((triangles("objects"), triangles("now")), (2 * 12, 12), "{of}");
    assert_eq!(triangles("back"), 2 * 60 * 60 + 12, "{of}");
    for key in [
        "colour1",
        "colour2",
        "colour3",
        "colour4",
        "colour5",
        "colour6",
        "pruned",
        "planning",
        "photoLegend",
        "turned",
        "swept",
    ] {
        assert_eq!(of[key], true, "{key}: {of}");
    }
    assert_eq!(
        of["colours"],
        serde_json::json!(["photo", "height", "normal", "state", "weight", "last seen", "error"])
    );
    assert_eq!(
        (
            &of["legend1"],
            &of["legend3"],
            &of["legend4"],
            &of["legend5"],
            &of["legend6"],
            &of["prunedName"]
        ),
        (
            &"-1.7 m to -1.6 m".into(),
            &"".into(),
            &"1 observation to 47 observations and more".into(),
            &"frame 0 to frame 22".into(),
            &"0 m from the reference to 0.30 m and more".into(),
            &"pruned blocks (2)".into(),
        ),
        "{of}"
    );
}

#[dynvox_needs::browser]
#[test]
fn without_a_graphics_card_motion_is_coarse_and_rest_is_whole() {
    let root = TempDir::new().unwrap();
    FakeRun { frames: 4, objects: 0, squares: 190, pictures: false }.write(root.path());
    // A pointer that is pressed and moved once, as when a map is turned.
    let script = r#"
const turn = (kind, x) => canvas.dispatchEvent(new PointerEvent(kind, {
  pointerId: 1, clientX: x, clientY: 200, buttons: 1, bubbles: true,
}));
canvas.setPointerCapture = () => {};
const whole = Number(data.triangles), share = shown().share;
turn("pointerdown", 200);
await drawn(() => turn("pointermove", 204));
const moving = Number(data.triangles), movingShare = shown().share;
await until(() => Number(data.triangles) > moving);
report({ whole, moving, rest: Number(data.triangles), share, movingShare });
"#;
    let of = visit(&viewer(root.path()), "", script);
    let triangles = |key: &str| of[key].as_f64().unwrap();
    assert!(
        triangles("whole") > 60_000.0
            && triangles("rest") > 8.0 * triangles("moving")
            && triangles("moving") > 100.0,
        "{of}"
    );
    // Coarse triangles cover what the fine ones do.
    assert!((triangles("share") - triangles("movingShare")).abs() < 0.1, "the same is seen: {of}");
}

#[dynvox_needs::browser]
#[test]
fn keys_play_and_step_and_are_shown_but_leave_controls_alone() {
    let root = TempDir::new().unwrap();
    FakeRun { frames: 12, objects: 2, squares: 60, pictures: true }.write(root.path());
    let script = r#"
const press = (code, on = document.body) => on.dispatchEvent(new KeyboardEvent("keydown", { code, bubbles: true, cancelable: true }));
await scrub(3);
const result = { from: data.frame };
await drawn(() => press("ArrowRight"));
result.right = data.frame;
await drawn(() => press("ArrowLeft"));
result.left = data.frame;
result.taken = !press("Space", root.querySelector(".colour"));
await scrub(0);
press("Space");
result.playing = root.querySelector(".play").textContent;
await until(() => data.frame !== "0");
press("Space");
result.stopped = root.querySelector(".play").textContent;
result.keys = root.querySelector(".keys").hidden;
result.titles = [...root.querySelectorAll(".layers label")].filter((label) => !label.title).length;
report(result);
"#;
    let of = visit(&viewer(root.path()), "", script);
    assert_eq!((&of["from"], &of["right"], &of["left"]), (&"6".into(), &"8".into(), &"6".into()));
    assert_eq!(
        (&of["taken"], &of["keys"], &of["titles"]),
        (&false.into(), &false.into(), &0.into())
    );
    assert_eq!((&of["playing"], &of["stopped"]), (&"❚❚".into(), &"▶".into()), "{of}");
}

#[dynvox_needs::browser]
#[test]
fn an_address_chooses_the_frame_and_a_phone_shows_it_whole() {
    let root = TempDir::new().unwrap();
    FakeRun { frames: 12, objects: 2, squares: 60, pictures: true }.write(root.path());
    let script = r#"
report({ share: shown().share, frame: data.frame, map: layer("map").checked, wide: document.documentElement.scrollWidth - innerWidth });
"#;
    let page = viewer(root.path());
    let script = &[HELPERS, script].concat();
    let of = Visit {
        page: &page,
        part: "#frame=6&hide=tracks&view=follow",
        window: Window::PHONE,
        before: "",
        script,
    }
    .report();
    assert!(
        of["share"].as_f64().unwrap() > 0.05 && of["frame"] == "6" && of["map"] == true,
        "{of}"
    );
    // Nothing is wider than the screen.
    assert!(of["wide"].as_i64().unwrap() <= 0, "{of}");
}

#[dynvox_needs::browser]
#[test]
fn extremes_give_a_page_that_makes_sense() {
    let script = r#"
report({
  frame: data.frame, note: root.querySelector(".note").textContent, reason: root.querySelector(".reason").textContent,
  triangles: Number(data.triangles || 0), colours: root.querySelector(".colour").options.length,
  live: root.classList.contains("live"), frames: root.querySelector(".slider").max,
});
"#;
    // Each page in a browser of its own.
    let of = |run: FakeRun, before: &str| {
        let root = TempDir::new().unwrap();
        run.write(root.path());
        visit(&viewer(root.path()), before, script)
    };
    // An empty map, many objects, many frames, and no WebGL.
    let empty = of(FakeRun { frames: 3, objects: 0, squares: 0, pictures: false }, "");
    assert!(
        empty["note"] == "The map is empty" && empty["live"] == true && empty["colours"] == 4,
        "{empty}"
    );
    let many = of(FakeRun { frames: 40, objects: 64, squares: 60, pictures: true }, "");
    assert!(many["triangles"].as_u64().unwrap() > 7_200, "{many}");
    let long = of(FakeRun { frames: 5_000, objects: 1, squares: 60, pictures: true }, "");
    assert!(long["frames"] == "4999" && long["live"] == true, "{long}");
    let none = of(
        FakeRun { frames: 3, objects: 0, squares: 10, pictures: true },
        "HTMLCanvasElement.prototype.getContext = () => null;",
    );
    assert!(
        none["live"] == false && none["reason"].as_str().unwrap().contains("no WebGL 2"),
        "{none}"
    );
}

/// A run of three frames, in `result`.
fn finished_run() -> TempDir {
    let root = TempDir::new().unwrap();
    rig(root.path(), 3);
    let run =
        dynvox(root.path(), &["run", "rig", "--profile", "tiny", "--out", "result", "--quiet"]);
    assert!(run.status.success(), "{}", output_text(&run));
    root
}

#[test]
fn the_report_of_a_run_has_the_viewer_and_its_pictures() {
    let root = finished_run();
    let result = root.path().join("result");
    let report = fs::read_to_string(result.join("report.html")).unwrap();
    assert!(
        report.contains("id=\"dynvox-viewer\"")
            && report.contains("dynvox-000002_left.jpg")
            && !report.contains("no viewer")
    );
    let index: serde_json::Value =
        serde_json::from_slice(&fs::read(result.join("pictures/index.json")).unwrap()).unwrap();
    assert_eq!(index, serde_json::json!({ "width": 160, "height": 64, "frames": [0, 1, 2] }));
    let left = image::open(result.join("pictures/000001_left.jpg")).unwrap();
    assert_eq!((left.width(), left.height()), (160, 64));
}

#[dynvox_needs::browser]
#[test]
fn the_viewer_in_the_report_of_a_run_draws() {
    let root = finished_run();
    let of =
        visit(&root.path().join("result/report.html"), "", "report({ share: shown().share });");
    assert!(of["share"].as_f64().unwrap() > 0.01, "{of}");
}
