//! `[problem.channels]`: problems in several channels.

use super::*;

/// A tube in two channels, with this below.
fn tube(channels: &str) -> String {
    format!(
        "[problem]\nkind = \"tube\"\nlength = 2\nends = [1, 0]\nreflectance = 0.5\n{channels}\n\
         [[target]]\nname = \"right\"\nover = \"right\"\n"
    )
}

/// The names of the channels of a file, and of their sum.
fn names(text: &str) -> Vec<String> {
    good(text)
        .resolve()
        .unwrap()
        .model
        .model()
        .channels()
        .to_vec()
}

#[test]
fn channels_have_what_their_tables_say_and_all_else_in_common() {
    // The order is that of the file, and the tree's is that of names.
    let colours = "[problem.channels.red]\nreflectance = 0.9\n[problem.channels.green]\n[problem.channels.blue]\nends = [0, 1]";
    assert_eq!(names(&tube(colours)), ["red", "green", "blue", "luminance"]);
    let inline = "channels = { near = { reflectance = 0.9 }, far = {} }";
    assert_eq!(names(&tube(inline)), ["near", "far", "sum"]);
    // Tables within a table, key by key: both channels know b.
    let cube = |last: &str| {
        format!(
            "[problem]\nkind = \"cube\"\ndimension = 1\nkernel = \"a*b*x*y\"\nsource = \"x\"\nsolution = \"c*x\"\n[problem.parameters]\na = 0.5\nb = 1\n\
             c = 1.2\n[problem.channels.low]\n[problem.channels.high]\nparameters = {{ a = 1.0, c = 1.5 }}\n{last}\n\
             [[target]]\nname = \"u\"\nat = 0.5\n"
        )
    };
    let file = good(&cube(""));
    let resolved = file.resolve().unwrap();
    let model = resolved.model.model();
    let goals = fredholm::goals(model, &resolved.targets).unwrap();
    let exact = goals
        .iter()
        .map(|goal| model.exact_of(goal).unwrap().unwrap());
    for (value, known) in exact.zip([0.6, 0.75, 1.35]) {
        assert!((value - known).abs() < 1e-15, "{value}");
    }
    // Results of other channels are not those of these.
    let identity = |text: &str| {
        let file = good(text);
        file.identity(&file.resolve().unwrap()).unwrap()
    };
    assert_ne!(identity(&cube("")), identity(&cube("source = \"2*x\"")));
    assert_ne!(
        identity(&tube(inline)),
        identity(&tube(
            "channels = { near = { reflectance = 0.9 }, deep = {} }"
        ))
    );
}

#[test]
fn wrong_channels_are_refused_at_their_place() {
    let is = |text: &str, wanted: &str| {
        let error = failure(text);
        assert!(error.contains(wanted), "{error}");
    };
    is(
        &tube("channels = { a = { colour = 1 } }"),
        "t.toml:6:20: unknown key `colour` in `[problem]`",
    );
    is(
        &tube("channels = { a = { reflectance = 2 } }"),
        "t.toml:6:34: `reflectance` must be from 0 to 1",
    );
    is(
        &tube("channels = [\"a\"]"),
        "`channels` must be a table, found an array",
    );
    is(
        &tube("channels = { a = 0.5 }"),
        "t.toml:6:18: `channels` is a table of tables",
    );
    is(&tube("channels = {}"), "1 to 128 channels, not 0");
    is(
        &tube("channels = { \" \" = {} }"),
        "must differ, and be printable: \" \"",
    );
    is(
        &tube("channels = { a = {}, b = { length = 3 } }").replace("over = \"right\"", "grid = 3"),
        "t.toml:1:1: the equations of all channels are of one kind, and have one space",
    );
    is(
        &tube("channels = { a = {}, b = { channels = { c = {} } } }"),
        "unknown key `channels`",
    );
    // Rooms have lists.
    is(
        "[problem]\nkind = \"room\"\nchannels = { a = {} }\n[[problem.surface]]\nname = \"a\"\npoints = [[0, 0], [1, 0]]\nreflectance = 0.5\n\
         emission = 1\n[[target]]\nname = \"u\"\nover = \"all\"\n",
        "`channels` must be an array of strings, found a table",
    );
}
