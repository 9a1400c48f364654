//! The hex text among the captures is made from the frames that the tests know, by recipes.
//!
//! A recipe is the capture with frames by name: that of a vector in `tests/vectors`, or of a response's with
//! `.request` for what it answers; or bytes and `CRC`, for those that have no vector.

use std::path::PathBuf;

use super::{content, path};

const NAMES: [&str; 4] = ["manual-do", "manual-conductivity", "manual-sonde", "y511"];

const VECTORS: [&str; 4] = [
    include_str!("../vectors/do.json"),
    include_str!("../vectors/conductivity.json"),
    include_str!("../vectors/sonde.json"),
    include_str!("../vectors/y511.json"),
];

/// Returns the frame that a recipe calls so, as hex text.
fn frame(name: &str, vectors: &[serde_json::Value]) -> String {
    if let Some(bytes) = name.strip_suffix(" CRC") {
        let bytes: Vec<u8> =
            bytes.split(' ').map(|byte| u8::from_str_radix(byte, 16).expect("hex digits")).collect();
        let crc = crc::Crc::<u16>::new(&crc::CRC_16_MODBUS).checksum(&bytes).to_le_bytes();
        let digits: Vec<String> = bytes.iter().chain(&crc).map(|byte| format!("{byte:02X}")).collect();
        return digits.join(" ");
    }
    let (name, key) = name.strip_suffix(".request").map_or((name, "hex"), |name| (name, "request"));
    let vector = vectors.iter().find(|vector| vector["name"] == name);
    let hex = vector.and_then(|vector| vector[key].as_str());
    hex.unwrap_or_else(|| panic!("no vector {name} has '{key}'")).to_uppercase()
}

/// Makes a capture by its recipe.
fn made(recipe: &str) -> String {
    let vectors: Vec<serde_json::Value> = VECTORS
        .iter()
        .flat_map(|text| serde_json::from_str::<Vec<serde_json::Value>>(text).expect("vectors"))
        .collect();
    let line = |line: &str| {
        let Some(mark) = ["> ", "< "].into_iter().find(|mark| line.starts_with(mark)) else {
            return format!("{line}\n");
        };
        let (name, remark) = line.split_at(line.find("  #").unwrap_or(line.len()));
        format!("{mark}{}{remark}\n", frame(&name[mark.len()..], &vectors))
    };
    recipe.lines().map(line).collect()
}

#[test]
fn the_hex_text_is_what_its_recipes_make() {
    let update = std::env::var_os("UPDATE_CAPTURES").is_some();
    for name in NAMES {
        let recipe: PathBuf =
            [env!("CARGO_MANIFEST_DIR"), "tests", "captures", &format!("{name}.recipe")].iter().collect();
        #[expect(clippy::disallowed_methods, reason = "recipes are files")]
        let made = made(&std::fs::read_to_string(recipe).expect("a recipe"));
        let name = format!("{name}.hex");
        if update {
            #[expect(clippy::disallowed_methods, reason = "captures are files")]
            std::fs::write(path(&name), made).expect("a capture that may be written");
        } else {
            assert!(content(&name) == made, "{name}: UPDATE_CAPTURES=1 cargo test --test captures");
        }
    }
}

#[test]
fn every_hex_text_has_a_recipe_and_is_documented() {
    let command = "UPDATE_CAPTURES=1 cargo test --test captures";
    assert!(content("README.md").contains(command));
    for entry in std::fs::read_dir(path("")).expect("captures/") {
        let name = entry.expect("an entry").file_name().into_string().expect("UTF-8");
        let stem = name.strip_suffix(".hex");
        assert!(stem.is_none_or(|stem| NAMES.contains(&stem)), "{name} has no recipe");
    }
}
