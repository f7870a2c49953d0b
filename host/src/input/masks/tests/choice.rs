//! Values of `--instances`, and where they are listed.

use super::*;

#[test]
fn sources_are_named_on_the_command_line() {
    let choice = |text: &str| text.parse::<MaskChoice>();
    assert_eq!(choice("files:a/b"), Ok(MaskChoice::Files(&indexed::FORMAT, PathBuf::from("a/b"))));
    assert_eq!(
        (choice("noisy"), choice("noisy:7")),
        (Ok(MaskChoice::Noisy(1)), Ok(MaskChoice::Noisy(7)))
    );
    assert_eq!(
        choice("onnx:a,b"),
        Ok(MaskChoice::Networks(vec![PathBuf::from("a"), PathBuf::from("b")]))
    );
    for text in ["auto", "none", "motion", "files:a/b", "mots:c", "onnx:a,b", "exact", "noisy:7"] {
        assert_eq!(choice(text).unwrap().to_string(), text);
    }
    for text in ["files:a/b", "noisy:7", "onnx:a,b"] {
        let saved = serde_json::to_string(&choice(text).unwrap()).unwrap();
        assert_eq!(serde_json::from_str::<MaskChoice>(&saved).unwrap(), choice(text).unwrap());
    }
    let other = serde_json::from_str::<MaskChoice>(r#"{"files": ["other", "a"]}"#).unwrap_err();
    assert!(other.to_string().contains("no masks are named other"), "{other}");
    for wrong in ["", "files", "files:", "onnx:", "other:a", "noisy:x", "AUTO"] {
        assert!(choice(wrong).is_err(), "{wrong}");
    }
    let finds_motion = |text: &str| choice(text).unwrap().finds_motion();
    assert_eq!(
        ["auto", "motion", "none", "files:a", "exact"].map(finds_motion),
        [Some(true), Some(true), Some(false), None, None]
    );
}

#[test]
fn the_documentation_and_the_help_list_every_format() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/inputs.md");
    let page = fs::read_to_string(page).unwrap();
    for format in MASK_FORMATS {
        let value = format!("{}:{}", format.name, format.value.split(' ').next().unwrap());
        assert!(page.contains(&format!("| `{value}` |")), "docs/inputs.md lacks {value}");
        assert!(MaskChoice::help().contains(&value), "{value}");
    }
}
