//! The C headers as they follow from `ffi/src`: cbindgen makes the items, `ffi/header/NAME.h` says where each stands.
//!
//! A line `@NAME` of such a file becomes the item of that name; `@enum TYPE START...` an enum of the constants whose names
//! begin so, and `@constants START...` one without a type. What is said of an item that comes with conditions, keeps them.

use std::collections::BTreeMap;
use std::path::Path;

/// The headers, by file name.
pub const HEADERS: [&str; 5] =
    ["blik.h", "blik_lights.h", "blik_update.h", "blik_form_factor.h", "blik_plane.h"];

/// Columns of a line.
const COLUMNS: usize = 120;

/// Arguments that mean the same wherever a function's own words do not say otherwise.
const USUAL: [(&str, &str); 7] = [
    ("run", "how the call runs; null: on the calling thread"),
    ("memory", "memory of the caller, at any address"),
    ("size", "its bytes"),
    ("scratch", "scratch memory; with the standard library null takes it from the heap"),
    ("scratch_size", "its bytes"),
    ("error", "receives what is wrong where the call is refused; null: not wanted"),
    ("user", "handed to the function"),
];

/// One item of the interface.
#[derive(Debug)]
struct Item {
    comment: Vec<String>,
    code: String,
    conditional: bool,
    used: bool,
}

/// All items by name, and the constants in the order of the source.
struct Items {
    all: BTreeMap<String, Item>,
    constants: Vec<String>,
}

impl Items {
    fn new(root: &Path) -> Items {
        let ffi = root.join("ffi");
        let config = cbindgen::Config::from_file(ffi.join("cbindgen.toml")).unwrap();
        let bindings =
            cbindgen::Builder::new().with_config(config).with_src(ffi.join("src/lib.rs")).generate().unwrap();
        let mut text = Vec::new();
        bindings.write(&mut text);
        let mut items = Items { all: BTreeMap::new(), constants: Vec::new() };
        items.read(&String::from_utf8(text).unwrap());
        items
    }

    fn read(&mut self, text: &str) {
        let (mut comment, mut code, mut conditional) = (Vec::new(), String::new(), false);
        let mut lines = text.lines().peekable();
        while let Some(line) = lines.next() {
            if line.starts_with("#if") {
                conditional = true;
            } else if line.starts_with("#endif") {
                conditional = false;
            } else if line.starts_with("/**") {
                comment.clear();
                while let Some(line) = lines.next_if(|line| !line.ends_with("*/")) {
                    let line = line.trim_start_matches(" *");
                    comment.push(line.strip_prefix(' ').unwrap_or(line).to_string());
                }
                lines.next();
            } else if !line.is_empty() {
                code += line;
                code.push('\n');
                let inside = code.matches('{').count() > code.matches('}').count();
                if line.starts_with("#define") || (!inside && line.ends_with(';')) {
                    self.add(std::mem::take(&mut comment), std::mem::take(&mut code), conditional);
                }
            }
        }
        assert!(code.is_empty(), "not understood: {code}");
    }

    fn add(&mut self, comment: Vec<String>, code: String, conditional: bool) {
        let name = name(&code);
        if code.starts_with("#define") {
            self.constants.push(name.clone());
        }
        let item = Item { comment: for_c(comment), code, conditional, used: false };
        assert!(self.all.insert(name.clone(), item).is_none(), "{name} twice");
    }

    fn take(&mut self, name: &str) -> &mut Item {
        let item = self.all.get_mut(name).unwrap_or_else(|| panic!("no item {name}"));
        assert!(!std::mem::replace(&mut item.used, true), "{name} stands in two places");
        item
    }

    /// An item as it stands in a header.
    fn item(&mut self, name: &str) -> String {
        let item = self.take(name);
        let (mut comment, mut code) = (item.comment.clone(), item.code.clone());
        if let Some(arguments) = arguments(&code) {
            complete(name, &mut comment, &arguments);
            code = prototype(&format!("BLIK_API {code}"));
        } else if code.contains('{') {
            code = members(&code);
        } else if code.contains("(*") {
            code = prototype(&code);
        } else if let Some(value) = code.split(' ').nth(2).and_then(|value| value.trim().parse::<u32>().ok())
        {
            // no int
            code = if value > 1 << 30 { format!("#define {name} {value:#x}u\n") } else { code };
        }
        let text = format!("{}{code}", block(&comment, ""));
        if item.conditional { format!("#ifdef BLIK_STD\n{text}#endif\n\n") } else { format!("{text}\n") }
    }

    /// An enum of the constants that start so.
    fn choices(&mut self, of: Option<&str>, starts: &[&str]) -> String {
        let mut text = String::new();
        if let Some(of) = of {
            text += &block(&self.take(of).comment, "");
        }
        text += &of.map_or("enum {\n".to_string(), |of| format!("typedef enum {of} {{\n"));
        let names: Vec<String> = self
            .constants
            .iter()
            .filter(|name| starts.iter().any(|s| name.starts_with(s)))
            .cloned()
            .collect();
        for name in names {
            let item = self.take(&name);
            let line = format!("    {name} = {},", item.code.split_whitespace().last().unwrap());
            text += &described(&line, &item.comment);
        }
        match of {
            // 32 bits wide whatever the compiler's options
            Some(of) => format!("{text}    {}_MAX_ENUM = 0x7fffffff\n}} {of};\n\n", of.to_uppercase()),
            None => format!("{text}}};\n\n"),
        }
    }
}

/// The headers as the source says, by file name; every item stands in one place.
pub fn generated(root: &Path) -> Vec<(&'static str, String)> {
    let mut items = Items::new(root);
    let mut all = Vec::new();
    for name in HEADERS {
        let order = std::fs::read_to_string(root.join("ffi/header").join(name)).unwrap();
        let mut text = String::new();
        for line in order.lines() {
            let words: Vec<&str> = line.strip_prefix('@').unwrap_or_default().split(' ').collect();
            text += &match words[..] {
                [""] => format!("{line}\n"),
                ["enum", of, ref starts @ ..] => items.choices(Some(of), starts),
                ["constants", ref starts @ ..] => items.choices(None, starts),
                [item] => items.item(item),
                _ => panic!("not understood: {line}"),
            };
        }
        all.push((name, text));
    }
    let left: Vec<&String> = items.all.iter().filter(|(_, item)| !item.used).map(|(name, _)| name).collect();
    assert!(left.is_empty(), "in no header of ffi/header: {left:?}");
    all
}

/// The name of an item.
fn name(code: &str) -> String {
    let word =
        |text: &str| text.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap().to_string();
    if let Some(rest) = code.strip_prefix("#define ") {
        return word(rest);
    }
    if let Some((_, rest)) = code.split_once("(*") {
        return word(rest);
    }
    if code.starts_with("typedef") {
        let end = code.rfind(';').unwrap();
        return code[..end].rsplit(['}', ' ', '\n']).next().unwrap().to_string();
    }
    let head = code.split('(').next().unwrap();
    head.rsplit([' ', '*']).next().unwrap().to_string()
}

/// A comment without what only Rust's documentation needs: paragraphs on safety and the brackets of links.
fn for_c(comment: Vec<String>) -> Vec<String> {
    let end = comment.iter().position(|line| line == "# Safety").unwrap_or(comment.len());
    // fenced code stands four columns in
    let mut fenced = false;
    let mut lines = Vec::new();
    for line in &comment[..end] {
        if line.starts_with("```") {
            fenced = !fenced;
        } else {
            let line = line.replace("[`", "").replace("`]", "").replace('`', "");
            lines.push(if fenced { format!("    {line}") } else { line });
        }
    }
    while lines.last().is_some_and(String::is_empty) {
        lines.pop();
    }
    lines
}

/// A comment as C has it.
fn block(comment: &[String], indent: &str) -> String {
    let one = format!("{indent}/* {} */\n", comment.join(" "));
    if comment.is_empty() {
        String::new()
    } else if one.len() <= COLUMNS && !comment.iter().any(String::is_empty) {
        one
    } else {
        let lines: Vec<String> =
            comment.iter().map(|line| format!("{indent} * {line}").trim_end().to_string()).collect();
        format!("{indent}/*{} */\n", lines.join("\n").strip_prefix(&format!("{indent} *")).unwrap())
    }
}

/// The names of a function's arguments; `None` where it is no function.
fn arguments(code: &str) -> Option<Vec<String>> {
    let open = code.find('(').filter(|_| !code.starts_with("typedef") && !code.starts_with('#'))?;
    let inner = code[open + 1..code.rfind(')')?].trim();
    let names = inner.split(',').filter(|argument| *argument != "void");
    Some(names.map(|argument| argument.trim().rsplit([' ', '*']).next().unwrap().to_string()).collect())
}

/// A prototype on as few lines as hold it.
fn prototype(code: &str) -> String {
    let words = code.split_whitespace().collect::<Vec<_>>().join(" ").replace("( ", "(").replace(" )", ")");
    let words = words.replace("struct ", "");
    let (head, arguments) = words.rsplit_once('(').unwrap();
    let (mut text, mut column) = (format!("{head}("), head.len() + 1);
    for argument in arguments.split_inclusive(", ") {
        if column + argument.trim_end().len() > COLUMNS {
            text = format!("{}\n    ", text.trim_end());
            column = 4;
        }
        text += argument;
        column += argument.len();
    }
    text + "\n"
}

/// A line for each argument, in their order: the function's own words, or the usual ones.
fn complete(function: &str, comment: &mut Vec<String>, arguments: &[String]) {
    let first = comment.iter().position(|line| line.starts_with("- ")).unwrap_or(comment.len());
    let mut given: Vec<Vec<String>> = Vec::new();
    for line in comment.drain(first..) {
        match given.last_mut() {
            Some(last) if !line.starts_with("- ") => last.push(line),
            _ => given.push(vec![line]),
        }
    }
    let width = arguments.iter().map(String::len).max().unwrap_or(0);
    if !arguments.is_empty() && comment.last().is_none_or(|line| !line.is_empty()) {
        comment.push(String::new());
    }
    for argument in arguments {
        let own = given.iter().position(|lines| lines[0].starts_with(&format!("- {argument}: ")));
        let words = match own {
            Some(own) => given
                .remove(own)
                .join(" ")
                .split_once(": ")
                .unwrap()
                .1
                .split_whitespace()
                .collect::<Vec<_>>()
                .join(" "),
            None => {
                let usual = USUAL.iter().find(|(name, _)| name == argument);
                usual.unwrap_or_else(|| panic!("{function} does not say what {argument} is")).1.to_string()
            }
        };
        let (mut line, indent) = (format!("  {argument:width$}  "), " ".repeat(width + 4));
        for word in words.split(' ') {
            if line.len() + word.len() + 3 > COLUMNS {
                comment.push(line.trim_end().to_string());
                line = indent.clone();
            }
            line += word;
            line.push(' ');
        }
        comment.push(line.trim_end().to_string());
    }
    assert!(given.is_empty(), "{function} has no such arguments: {given:?}");
    while comment.last().is_some_and(String::is_empty) {
        comment.pop();
    }
}

/// A struct whose members have their comments behind them where they fit, else above.
fn members(code: &str) -> String {
    let (mut text, mut comment, mut inside) = (String::new(), Vec::new(), false);
    for line in code.lines() {
        let trimmed = line.trim();
        if trimmed == "/**" {
            inside = true;
        } else if trimmed == "*/" {
            inside = false;
        } else if inside {
            comment.push(trimmed.trim_start_matches('*').trim_start().to_string());
        } else {
            let line = if line.contains('{') { line.to_string() } else { line.replace("struct ", "") };
            text += &described(&line, &for_c(std::mem::take(&mut comment)));
        }
    }
    text
}

/// A member of an enum or struct with its comment: behind it where both fit on one line, else above.
fn described(line: &str, comment: &[String]) -> String {
    let text = block(comment, "");
    if text.lines().count() == 1 && line.len() + 1 + text.trim_end().len() <= COLUMNS {
        format!("{line} {text}")
    } else {
        format!("{}{line}\n", block(comment, "    "))
    }
}
