//! What is said of a wrong profile, and where.

use super::*;

const GOOD: &str = r#"id = "acme-level"
name = "level probe"
[[command]]
name = "get-level"
function = 3
register = 0x10
quantities = [2]
response = [
    { name = "level", offset = 0, type = "i16", unit = "m", scale = 0.1, quantity = true },
    { name = "state", offset = 2, type = "flags", length = 2 },
]
"#;

/// Returns what is said of the good profile with one part replaced.
fn said(part: &str, replacement: &str) -> Vec<String> {
    assert!(GOOD.contains(part), "{part}");
    match profile(&GOOD.replacen(part, replacement, 1)) {
        Ok(_) => Vec::new(),
        Err(problems) => problems.iter().map(Problem::to_string).collect(),
    }
}

#[track_caller]
fn assert_said(part: &str, replacement: &str, expected: &[&str]) {
    assert_eq!(said(part, replacement), expected);
}

#[test]
fn a_right_profile_is_read() {
    let profile = profile(GOOD).expect("a profile");
    assert_eq!((&*profile.id, profile.commands.len()), ("acme-level", 1));
    assert_eq!(profile.commands[0].response[1].span(), 2..4);
    assert_eq!(profile.command(3, 0x10).map(|command| &*command.name), Some("get-level"));
}

#[test]
fn models_source_and_confidence_are_read_and_checked() {
    let name = "name = \"level probe\"";
    let with = |keys: &str| format!("{name}\n{keys}");
    let text = GOOD.replacen(name, &with("models = [\"L1\"]\nsource = \"code\"\nconfidence = \"low\""), 1);
    let profile = profile(&text).expect("a profile");
    assert_eq!((&*profile.models[0], profile.source), ("L1", Source::Code));
    assert_eq!(profile.confidence, Some(Confidence::Low));
    assert_said(
        name,
        &with("confidence = \"hihg\""),
        &["3:14: 'hihg' is no confidence; did you mean 'high'?"],
    );
    assert_said(name, &with("models = \"L1\""), &["3:10: 'models' is of type string, not a list"]);
}

#[test]
fn an_error_names_text_line_and_column() {
    let text = GOOD.replace("offset = 0", "offset = -1");
    let error = Profile::from_toml(&text, "acme.toml").expect_err("a negative offset");
    assert_eq!(error.to_string(), "acme.toml:9:32: 'offset' is -1, not a whole number from 0 to 249");
    assert_eq!((error.problems()[0].line, error.problems()[0].column), (9, 32));
}

#[test]
fn every_problem_is_told_in_the_order_of_the_text() {
    let text = "name = 5\n[[command]]\nfunction = 99\nregistr = 1\n";
    let problems = profile(text).expect_err("a poor profile");
    let told: Vec<String> = problems.iter().map(Problem::to_string).collect();
    assert_eq!(
        told,
        [
            "1:1: 'id' is missing",
            "1:8: 'name' is of type integer, not a text",
            "2:1: 'name' is missing",
            "2:1: 'register' is missing",
            "2:1: 'quantities' is missing",
            "3:12: function 99; a command reads with 3 or 4, or writes with 6 or 16",
            "4:1: unknown key 'registr'; did you mean 'register'?",
        ]
    );
}

#[test]
fn columns_count_characters() {
    assert_said(r#""m", scale"#, r#""µ", scal"#, &["9:61: unknown key 'scal'; did you mean 'scale'?"]);
}

#[test]
fn syntax_has_its_place() {
    let told = said("quantities = [2]", "quantities = [2");
    assert!(told[0].starts_with("8:") || told[0].starts_with("7:"), "{told:?}");
    let told = said("function = 3", "function = 3\nfunction = 3");
    assert_eq!(told, ["6:1: duplicate key"]);
}

#[test]
fn absurd_places_and_sizes_are_refused() {
    let beyond = "10:32: the field ends after 250 bytes, the largest quantity has 4";
    assert_said("offset = 2, type = \"flags\", length = 2", "offset = 248, type = \"u16\"", &[beyond]);
    let huge = "9:32: 'offset' is 99999999999999999999, not a whole number from 0 to 249";
    assert_said("offset = 0", "offset = 99999999999999999999", &[huge]);
    assert_said("0x10", "0x10000", &["6:12: 'register' is 0x10000, not a whole number from 0 to 65535"]);
    assert_said("length = 2", "length = 3", &["10:60: 'flags' has a length of 1, 2 or 4 bytes"]);
    let length = "10:60: 'length' is 1000000, not a whole number from 1 to 250";
    assert!(said("length = 2", "length = 1000000").contains(&length.to_owned()));
    assert_said("scale = 0.1", "scale = 0", &["9:69: a scale of 0 leaves nothing of a value"]);
    assert_said("scale = 0.1", "scale = inf", &["9:69: 'scale' is not a finite number"]);
}

#[test]
fn duplicates_and_overlaps_are_refused() {
    assert_said("\"state\"", "\"level\"", &["10:14: a second field 'level'"]);
    assert_said("offset = 2", "offset = 1", &["10:32: 'state' overlaps 'level' (0 to 1)"]);
    let twice = format!("{GOOD}{}", &GOOD[GOOD.find("[[command]]").expect("a command")..]);
    let told: Vec<_> = profile(&twice).expect_err("twice").iter().map(Problem::to_string).collect();
    assert_eq!(told[0], "13:8: a second command 'get-level'");
    assert!(told[1].starts_with("15:12: a second command with function 3 at register 0x0010; list all"));
}

#[test]
fn fields_that_exclude_each_other_may_overlap() {
    let conditional = |condition: &str| {
        let level = format!("type = \"i16\", {condition} = {{ offset = 2, text = \"YL\" }}, unit");
        let state = "type = \"i16\", unless = { offset = 2, text = \"YL\" }";
        GOOD.replace("type = \"i16\", unit", &level).replace(
            "\"state\", offset = 2, type = \"flags\", length = 2",
            &format!("\"level\", offset = 1, {state}"),
        )
    };
    assert!(profile(&conditional("when")).is_ok(), "{:?}", profile(&conditional("when")));
    assert_eq!(profile(&conditional("unless")).expect_err("both can be there").len(), 2);
}

#[test]
fn types_are_named_and_hinted_at() {
    assert_said("\"i16\"", "\"f32-el\"", &["9:42: 'f32-el' is no type; did you mean 'f32-le'?"]);
    assert!(said("\"i16\"", "\"quux\"")[0].contains("use one of f32-le, "));
    assert_said("type = \"i16\"", "type = \"ascii\"", &["9:42: 'ascii' needs a length; length = 12, say"]);
    assert_said("type = \"flags\"", "type = \"u8\"", &["10:57: the type 'u8' has a length of its own"]);
}

#[test]
fn what_does_not_suit_a_type_is_refused() {
    assert_said("length = 2", "scale = 2", &["10:59: 'scale' is for a number only"]);
    assert_said("length = 2", "quantity = true", &["10:62: 'quantity' is for a number only"]);
    assert_said(
        "scale = 0.1",
        "show = \"hexagonal\"",
        &["9:68: 'hexagonal' is no show; did you mean 'hex'?"],
    );
    assert_said(
        "scale = 0.1",
        "range = [5, 1]",
        &["9:69: 'range' is not the lowest and the highest plausible value"],
    );
    assert_said(
        "scale = 0.1",
        "notes = [{ text = \"odd\" }]",
        &["9:70: a note has one of 'equals', 'above', 'below'; for all values, use 'note'"],
    );
    let bits = "bits = [{ mask = 1, text = \"a\" }, { mask = 1, text = \"b\" }]";
    assert_said("length = 2", bits, &["10:94: a second text for mask 1"]);
}

#[test]
fn a_side_without_data_has_no_fields() {
    let message = "9:5: a response of function 16 has no data for fields";
    assert_said("function = 3", "function = 16", &[message]);
    let request = "request = [{ name = \"x\", offset = 0, type = \"u8\" }]";
    let told = said("quantities = [2]", &format!("quantities = [2]\n{request}"));
    assert_eq!(told, ["8:12: a request of function 3 has no data for fields"]);
}

#[test]
fn a_fingerprint_is_not_contested() {
    let message = "9:13: a fingerprint, which only one kind has, is not contested";
    let both = "quantities = [2]\nfingerprint = true\ncontested = true";
    assert_said("quantities = [2]", both, &[message]);
    assert_said("quantities = [2]", "quantities = [2]\ncontested = true", &[]);
    assert_said("quantity = true", "quantity = true, contested = true", &[]);
}

#[test]
fn quantities_outside_the_specification_are_declared() {
    let hint = "declare it: quirks = [\"zero-quantity\"]";
    assert_said(
        "quantities = [2]",
        "quantities = [0, 2]",
        &[&format!("7:14: the specification knows no quantity 0; {hint}")],
    );
    assert_said("[2]", "[0, 2]\nquirks = [\"zero-quantity\"]", &[]);
    assert_said(
        "[2]",
        "[2]\nquirks = [\"zero-quantity\"]",
        &["8:10: the quirk 'zero-quantity' is declared, but 0 is not among the quantities"],
    );
    assert_said(
        "[2]",
        "[2]\nquirks = [\"zero\"]",
        &["8:11: 'zero' is no quirk; use one of zero-quantity, uncounted-data, counts-registers"],
    );
    assert_said("[2]", "[2, 2]", &["7:14: a quantity is given twice"]);
    assert_said("[2]", "[2, 126]", &["7:18: 'quantities' is 126, not a whole number from 0 to 125"]);
}

#[test]
fn derived_values_have_known_formulas_and_inputs() {
    let derived = |rest: &str| {
        let text = format!("{GOOD}[[derived]]\nname = \"tds\"\n{rest}");
        profile(&text).map_or_else(|problems| problems[0].to_string(), |_| String::new())
    };
    assert_eq!(derived("formula = \"tds\"\ninputs = [\"level\"]"), "");
    assert_eq!(
        derived("formula = \"tdx\"\ninputs = [\"level\"]"),
        "14:11: 'tdx' is no formula; did you mean 'tds'?"
    );
    let input = "15:11: no response has a number 'levle'; did you mean 'level'?";
    assert_eq!(derived("formula = \"tds\"\ninputs = [\"levle\"]"), input);
    let state = "15:11: no response has a number 'state'; name a number of a response";
    assert_eq!(derived("formula = \"tds\"\ninputs = [\"state\"]"), state);
    let count = "15:10: 'do-mg-l' takes saturation as a fraction of 1 and temperature in °C";
    assert_eq!(derived("formula = \"do-mg-l\"\ninputs = [\"level\"]"), count);
}

#[test]
fn a_profile_has_commands_and_a_plain_id() {
    let none = "id = \"a\"\nname = \"b\"\n";
    let told: Vec<_> = profile(none).expect_err("no command").iter().map(Problem::to_string).collect();
    assert_eq!(told, ["1:1: there is no command; a profile has at least one [[command]]"]);
    let id = "1:6: 'Acme Level' is not made of up to 64 lower-case letters, digits and '-'";
    assert_said("\"acme-level\"", "\"Acme Level\"", &[id]);
    assert_said(
        "name = \"level probe\"",
        "name = \"x\"\nservice-address = 1",
        &["3:19: 'service-address' is 1, not a whole number from 248 to 255"],
    );
}

#[test]
fn absurd_depth_is_a_message() {
    for text in ["x = ".to_owned() + &"[".repeat(100_000), "x = ".to_owned() + &"{a=".repeat(100_000)] {
        assert!(!profile(&text).expect_err("too deep").is_empty());
    }
    let dotted = "a.".repeat(20_000) + "b = 1";
    assert!(!profile(&dotted).expect_err("too deep").is_empty());
}
