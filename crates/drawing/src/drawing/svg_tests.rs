//! SVG as people's programs write it: read as browsers show it, and nothing lost without a word.
use std::path::Path;

use super::svg::{SvgOptions, parse};
use super::{Drawing, Loaded};

fn load(svg: &str) -> Loaded {
    parse(svg.as_bytes(), Path::new("a.svg"), &SvgOptions::default()).unwrap()
}

/// A page of 100 x 100 mm in mm, everything stroked black.
fn page(body: &str) -> String {
    format!(
        "<svg xmlns='http://www.w3.org/2000/svg' xmlns:inkscape='http://www.inkscape.org/namespaces/inkscape' \
         width='100mm' height='100mm' viewBox='0 0 100 100' stroke='black' fill='none'>{body}</svg>"
    )
}

fn draw(body: &str) -> Loaded {
    load(&page(body))
}

fn told(loaded: &Loaded) -> String {
    loaded.warnings.iter().map(|w| format!("{w}\n")).collect()
}

/// Bounds on the page, mm from its upper left.
fn bounds(d: &Drawing) -> [f64; 4] {
    let points = d.layers.iter().flat_map(|l| &l.strokes).flat_map(|s| &s.points);
    points.fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], |b, p| {
        let (x, y) = (1e3 * (p.x + 0.5 * d.width), 1e3 * (0.5 * d.height - p.y));
        [b[0].min(x), b[1].min(y), b[2].max(x), b[3].max(y)]
    })
}

#[track_caller]
fn assert_bounds(d: &Drawing, want: [f64; 4]) {
    let got = bounds(d);
    assert!(got.iter().zip(want).all(|(a, b)| (a - b).abs() < 0.02), "{got:?}, not {want:?}");
}

#[track_caller]
fn assert_length(loaded: &Loaded, mm: f64) {
    let got = 1e3 * loaded.drawing.length();
    assert!((got - mm).abs() < 1e-3 * mm, "{got} mm, not {mm}: {}", told(loaded));
}

fn colors(d: &Drawing) -> Vec<String> {
    d.layers.iter().map(|l| format!("{:02x?}", l.color.0).replace(['[', ']', ',', ' '], "")).collect()
}

#[test]
fn style_sheets_choose_by_place_attribute_and_medium() {
    let cases = [
        (":root { stroke: #010203 }", "010203"),
        ("@media screen { path { stroke: #010203 } } @media print { path { stroke: #ff0000 } }", "010203"),
        ("path:nth-of-type(2n + 1) { stroke: #010203 }", "010203"),
        ("g > path:not(.x):first-child { stroke: #010203 }", "010203"),
        ("path[data-pen='2'] { stroke: #010203 }", "010203"),
        ("title + g path { stroke: #010203 }", "010203"),
        ("svg|path, rect { STROKE: #010203 } /* path { stroke: red } */", "010203"),
        ("#p { stroke: #010203 } path { stroke: red }", "010203"),
        ("path { stroke: #010203 !important } #p { stroke: red }", "010203"),
        (":is(rect, .a) { stroke: #010203 }", "010203"),
        ("path:hover { stroke: red } path { stroke: #010203 }", "010203"),
    ];
    for (css, color) in cases {
        let svg =
            page(&format!("<style>{css}</style><title/><g><path id='p' class='a b' data-pen='2' d='M0 1H9'/></g>"));
        let svg = svg.replace(" stroke='black'", "").replace("<g>", "<g class='layer'>");
        let loaded = load(&svg);
        assert_eq!(colors(&loaded.drawing), [color], "{css}");
        assert_eq!(told(&loaded), "", "{css}");
    }
}

#[test]
fn rules_that_are_not_understood_are_told_with_their_line() {
    let all = told(&draw(
        "<path d='M0 1H9'/><style>\npath:has(a) { stroke: red }\n@import url(a.css);\n\n@container (width) { a { b: c } }</style>",
    ));
    for part in [
        "line 2: 1 x style sheet selector `path:has(a)`",
        "line 3: 1 x style sheet `@import`",
        "line 5: 1 x style sheet rule",
    ] {
        assert!(all.contains(part), "{part} in {all}");
    }
}

#[test]
fn variables_have_values_fallbacks_and_heirs() {
    let loaded = draw(
        "<style>:root { --ink: #c00000; --a: var(--ink) }</style>\
         <path d='M0 1H10' style='stroke: var(--a)'/><path d='M0 2H10' style='stroke:var(--no, var(--ink))'/>\
         <g style='--ink: #00c000'><path d='M0 3H10' stroke='var(--ink)'/></g>",
    );
    assert_eq!(colors(&loaded.drawing), ["c00000", "00c000"]);
    let lost = told(&draw("<path d='M0 1H10'/><path d='M0 2H10' style='stroke-width:var(--no)'/>"));
    assert!(lost.contains("var()") && lost.contains("var(--no)"), "{lost}");
    // A variable that names itself ends.
    assert!(
        told(&draw("<style>:root{--a:var(--b);--b:var(--a)}</style><path d='M0 1H9' stroke-width='var(--a)'/>"))
            .contains("var(")
    );
}

#[test]
fn geometry_comes_from_style_sheets() {
    let loaded = draw(
        "<style>circle{r:20px;cx:50px;cy:50px} .bar{x:10px;y:80px;width:30px;height:10px}</style>\
         <circle/><rect class='bar'/><path style=\"d:path('M10 20H90')\"/>",
    );
    assert_length(&loaded, 40.0 * std::f64::consts::PI + 160.0);
    assert!(told(&draw("<path d='M0 1H9'/><rect width='9'/><circle/>")).contains("rect without a size"));
}

#[test]
fn lengths_are_read_in_every_unit() {
    let px = 25.4 / 96.0;
    let cases = [
        ("100Q", 25.0 / px),
        ("2rem", 32.0),
        ("50vw", 50.0),
        ("calc(10px + 5px)", 15.0),
        ("calc(100% - 2 * 20px)", 60.0),
        ("20PX", 20.0),
        ("10,5", 10.5),
        (" 30 ", 30.0),
        ("min(4px, 50%)", 4.0),
        ("calc(10px - 2px - 3px)", 5.0),
        ("5mm", 5.0 / px),
        ("calc((1px + 2px) * 4)", 12.0),
        ("1e1", 10.0),
    ];
    for (text, length) in cases {
        assert_length(&draw(&format!("<line x2='{text}' y1='50' y2='50'/>")), f64::min(length, 100.0));
    }
    let all = told(&draw(
        "<path d='M0 1H9'/>\n<line x2='12 foo' y1='9' y2='9'/>\n<rect x='0' y='0' width='40,5,1' height='9'/>",
    ));
    assert!(all.contains("line 2: 1 x length x2 `12 foo`") && all.contains("line 3: 1 x length width"), "{all}");
}

#[test]
fn page_sizes_are_read_as_meant() {
    let sizes = [
        "width='100MM' height='100 mm'",
        "width='100,0mm' height='10cm'",
        "style='width:100mm;height:calc(5cm + 50mm)'",
    ];
    for size in sizes {
        let svg = page("<path d='M10 10H90'/>").replace("width='100mm' height='100mm'", size);
        assert_length(&load(&svg), 80.0);
    }
    let units = page("<path d='M10 10H90'/>").replace("'0 0 100 100'", "'0 0 100mm 100mm'");
    assert_length(&load(&units), 80.0);
    let broken = page("<path d='M10 10H90'/>").replace("width='100mm' height='100mm'", "width='100 furlongs'");
    assert!(told(&load(&broken)).contains("size of the page, width `100 furlongs`"));
}

#[test]
fn transforms_of_css_move_shapes() {
    for (style, want) in [
        ("transform: translate(0px, 40px)", [40.0, 40.0, 60.0, 60.0]),
        ("transform: translateX(10px) scaleY(2)", [50.0, 0.0, 70.0, 40.0]),
        ("transform: rotate(0.5turn); transform-origin: 50px 50px", [40.0, 80.0, 60.0, 100.0]),
        ("transform: rotate(90deg); transform-box: fill-box; transform-origin: right bottom", [60.0, 0.0, 80.0, 20.0]),
        ("transform: translate(50%, 10%)", [90.0, 10.0, 110.0, 30.0]),
        ("translate: 5px 6px; scale: 1", [45.0, 6.0, 65.0, 26.0]),
        ("transform: matrix(1, 0, 0, 1, 1, 2)", [41.0, 2.0, 61.0, 22.0]),
    ] {
        let svg = page(&format!("<rect x='40' width='20' height='20' style='{style}'/>"));
        let loaded =
            parse(svg.as_bytes(), Path::new("a.svg"), &SvgOptions { crop: false, ..Default::default() }).unwrap();
        assert_bounds(&loaded.drawing, want);
    }
    assert!(
        told(&draw("<path d='M0 1H9'/><path d='M0 2H9' style='transform: rotate3d(1,2,3,4deg)'/>"))
            .contains("broken transform")
    );
}

#[test]
fn colours_are_read_in_every_spelling_or_told() {
    for (text, want) in [
        ("Red", "ff0000"),
        ("CurrentColor", "000000"),
        ("rgb(255 0 0 / 1)", "ff0000"),
        ("hsl(120deg 100% 25%)", "008000"),
        ("hwb(240 0% 0%)", "0000ff"),
        ("oklch(62.796% 0.25768 29.234)", "ff0000"),
        ("oklab(0.51975 -0.1403 0.10768)", "008000"),
        ("lab(54.29 80.8 69.89)", "ff0000"),
        ("color(srgb 0 0.5 1)", "0080ff"),
    ] {
        let loaded = draw(&format!("<path d='M0 1H9' stroke='{text}'/>"));
        assert_eq!(colors(&loaded.drawing), [want], "{text}: {}", told(&loaded));
    }
    let all = told(&draw(
        "<path d='M0 1H9'/>\n<path d='M0 2H9' stroke='dark blue'/>\n<path d='M0 3H9' stroke='#12345'/>\n<path d='M0 4H9' stroke='url(#no)'/>",
    ));
    for part in ["line 2: 1 x colour `dark blue`", "line 3: 1 x colour `#12345`", "line 4: 1 x stroke `url(#no)`"] {
        assert!(all.contains(part), "{part} in {all}");
    }
}

#[test]
fn symbols_have_a_place_and_a_size_of_their_own() {
    let own = draw(
        "<symbol id='s' viewBox='0 0 10 10' width='20' height='20'><rect x='1' y='1' width='8' height='8'/></symbol><use x='30' y='30' href='#s'/>",
    );
    assert_bounds(&own.drawing, [32.0, 32.0, 48.0, 48.0]);
    let moved = draw(
        "<symbol id='s' x='-10' y='-10' viewBox='-10 -10 20 20'><circle r='8'/></symbol><use href='#s' x='50' y='50' width='20' height='20'/>",
    );
    assert_bounds(&moved.drawing, [42.0, 42.0, 58.0, 58.0]);
}

#[test]
fn flat_lines_missing_filters_hairlines_and_path_lengths_are_drawn() {
    let gradient =
        "<linearGradient id='g'><stop stop-color='#a00000'/><stop offset='1' stop-color='#a00000'/></linearGradient>";
    let flat = draw(&format!("{gradient}<path d='M10 20H90' stroke='url(#g)'/>"));
    assert_length(&flat, 80.0);
    assert_eq!(colors(&flat.drawing), ["a00000"]);
    let filtered = draw("<path d='M10 20H90' filter='url(#gone)'/>");
    assert_length(&filtered, 80.0);
    assert!(told(&filtered).contains("filter"));
    let hair = draw("<path d='M10 20H90' stroke-width='0'/>");
    assert_length(&hair, 80.0);
    assert!(hair.drawing.layers[0].width_hint.is_none() && told(&hair).contains("hairline"));
    let dashes = draw("<path d='M10 20H90' pathLength='100' stroke-dasharray='25 25'/>");
    assert_eq!(dashes.drawing.stroke_count(), 2);
    assert_length(&dashes, 40.0);
}

#[test]
fn coordinates_far_away_keep_lines_apart() {
    let lines: String =
        (1..=10).map(|i| format!("<path d='M2506746.05 {}H2506760.05'/>", 5_624_643.0 + 0.1 * f64::from(i))).collect();
    let page = |view: &str, body: &str| {
        format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='180mm' height='80mm' viewBox='{view}' fill='none' stroke='black'>{body}</svg>"
        )
    };
    let viewed = page("2506744 5624642 18 8", &lines);
    let moved = page("0 0 18 8", &format!("<g transform='translate(-2506744 -5624642)'>{lines}</g>"));
    for svg in [viewed, moved] {
        let loaded = load(&svg);
        assert_eq!(loaded.drawing.stroke_count(), 10);
        assert_bounds(&loaded.drawing, [20.5, 11.0, 160.5, 20.0]);
    }
}

#[test]
fn shapes_of_the_papers_colour_hide_the_lines_under_them() {
    let lines = "<path d='M10 30H90M10 50H90M10 70H90'/>";
    let cover =
        |extra: &str| format!("{lines}<rect x='35' y='20' width='30' height='60' fill='#fff' stroke='none' {extra}/>");
    let hidden = draw(&cover(""));
    assert_length(&hidden, 150.0);
    assert!(told(&hidden).contains("hides"));
    assert_length(&draw(&cover("fill-opacity='0.5'")), 240.0);
    // Under the lines it hides nothing, nor does a line along the edge of the shape.
    assert_length(
        &draw("<rect x='35' y='20' width='30' height='60' fill='#fff' stroke='none'/><path d='M10 30H90'/>"),
        80.0,
    );
    assert_length(
        &draw("<path d='M35 20H65'/><rect x='35' y='20' width='30' height='60' fill='#fff' stroke='none'/>"),
        30.0,
    );
    let outlined = draw(&format!("{lines}<rect x='35' y='20' width='30' height='60' fill='#fff' stroke='black'/>"));
    assert_length(&outlined, 150.0 + 180.0);
}

#[test]
fn lines_drawn_twice_are_told() {
    assert!(told(&draw("<path d='M10 10H90'/><path d='M90 10H10'/>")).contains("80 mm of line are drawn again"));
    assert_eq!(told(&draw("<path d='M10 10H90'/><path d='M90 20H10' stroke='red'/>")), "");
}

#[test]
fn layers_keep_their_names() {
    let layer = |label: &str, id: &str, y: u8, color: &str| {
        format!(
            "<g inkscape:groupmode='layer' inkscape:label='{label}' {id}><path d='M10 {y}H90' stroke='{color}'/></g>"
        )
    };
    let names = |body: &str| draw(body).drawing.layers.iter().map(|l| l.name.clone()).collect::<Vec<_>>();
    let same = layer("pen 2", "id='a'", 10, "red") + &layer("pen 2", "id='b'", 20, "blue");
    assert_eq!(names(&same), ["pen 2 #ff0000", "pen 2 #0000ff"]);
    let doubled = layer("sky", "id='a'", 10, "red") + &layer("sea", "id='a'", 20, "blue");
    assert_eq!(names(&doubled), ["sky", "sea"]);
    let wrapped = format!("<g>{}{}</g>", layer("sky", "", 10, "red"), layer("sea", "", 20, "blue"));
    assert_eq!(names(&wrapped), ["sky", "sea"]);
    let merged = draw(&(layer("sky", "", 10, "red") + &layer("sea", "", 20, "red")));
    assert!(told(&merged).contains("layers `sky`, `sea` are of one colour"), "{}", told(&merged));
}

#[test]
fn doubled_ids_refer_to_the_first() {
    let loaded = draw("<defs><path id='p' d='M10 10H20'/><path id='p' d='M10 10H60'/></defs><use href='#p'/>");
    assert_length(&loaded, 10.0);
}

#[test]
fn what_no_viewer_shows_is_not_missed() {
    for body in [
        "<style>.h{display:none}</style><text class='h'>a</text>",
        "<style>.h{visibility:hidden}</style><g class='h'><text>a</text></g>",
        "<g opacity='0'><text>a</text></g>",
        "<symbol id='s'><image href='a.png'/></symbol>",
        "<switch><foreignObject requiredExtensions='urn:x'/><g><path d='M0 9H9'/></g></switch>",
        "<inkscape:path-effect/><text display='none'>a</text><defs><text>b</text></defs>",
        "<switch><text systemLanguage='fr'>a</text><path d='M0 9H9'/></switch>",
    ] {
        assert_eq!(told(&draw(&format!("<path d='M0 1H9'/>{body}"))), "", "{body}");
    }
    assert!(told(&draw("<path d='M0 1H9'/><flowRoot/>")).contains("flowRoot"));
    assert!(
        told(&draw("<path d='M0 1H9'/><symbol id='s'><text>a</text></symbol><use href='#s'/>")).contains("1 x text")
    );
}

#[test]
fn unknown_names_are_told_with_the_nearest() {
    let all = told(&draw(
        "<path d='M0 1H9'/>\n<PATH d='M0 2H9'/><polyLine points='0,3 9,3'/><spline/><path d='M0 3H9' storke='red'/>",
    ));
    for part in
        ["line 2: 1 x `PATH`", "did you mean `path`?", "did you mean `polyline`?", "`spline`", "did you mean `stroke`?"]
    {
        assert!(all.contains(part), "{part} in {all}");
    }
}

#[test]
fn prefixes_without_a_declaration_are_read() {
    let dtd = "<!DOCTYPE svg [\n<!ATTLIST g xmlns:kvg CDATA #FIXED 'http://kanjivg.tagaini.net' kvg:element CDATA #IMPLIED >\n]>\n";
    let loaded = load(&format!("{dtd}{}", page("<g kvg:element='x'><path d='M0 1H9'/></g>")));
    assert_length(&loaded, 9.0);
    assert_eq!(told(&loaded), "");
    assert!(told(&draw("<g sodipodi:x='1'><path d='M0 1H9'/></g>")).contains("prefix `sodipodi`"));
}

#[test]
fn packed_and_wide_files_are_read() {
    use std::io::Write as _;
    let svg = page("<path d='M0 1H9'/>");
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(svg.as_bytes()).unwrap();
    let wide: Vec<u8> = [0xfeff].into_iter().chain(svg.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    for bytes in [packer.finish().unwrap(), wide, [b"\xef\xbb\xbf", svg.as_bytes()].concat()] {
        assert_length(&parse(&bytes, Path::new("a.svg"), &SvgOptions::default()).unwrap(), 9.0);
    }
}
