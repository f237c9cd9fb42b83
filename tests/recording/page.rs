//! The page that plays a recording, as text. In a browser: `tests/outside_tools.rs`.

use hippocamp::html;
use hippocamp::recording::Recording;

use crate::common::{record, record_with};

/// The data inside `page`.
fn data(page: &str) -> serde_json::Value {
    let (_, rest) = page.split_once("<script id=\"data\" type=\"application/json\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn a_name_cannot_end_the_script_element_of_the_page() {
    let mut recording = Recording::parse(&record().1, "test").unwrap();
    let plain = html::page(&recording);
    recording.robot.name = "</script><script>alert(1)</script><!--".to_owned();
    let page = html::page(&recording);
    assert_eq!(page.matches("</script").count(), plain.matches("</script").count());
    assert_eq!(data(&page)["robot"], recording.robot.name.as_str());
}

#[test]
fn the_page_needs_no_other_file() {
    let page = html::page(&Recording::parse(&record().1, "test").unwrap());
    for reference in ["http:", "https:", "src=", "@import", "url(", "fetch(", "import("] {
        assert!(!page.contains(reference), "{reference}");
    }
}

#[test]
fn the_page_has_fifty_frames_a_second_of_every_joint_and_leg() {
    let (report, bytes) = record_with("[[fault]]\nkind = 'imu-silent'\nat_s = 4\nfor_s = 1\n");
    let page = html::page(&Recording::parse(&bytes, "test").unwrap());
    let data = data(&page);
    let frames = |value: &serde_json::Value| value.as_array().unwrap().len();
    assert_eq!(frames(&data["time"]) as u64, report.cycles.div_ceil(2));
    assert_eq!((frames(&data["measured"]), frames(&data["goal"]), frames(&data["contact"])), (16, 16, 4));
    assert_eq!(frames(&data["measured"][15]), frames(&data["time"]));
    // Known while the unit is heard.
    let times: Vec<f64> =
        data["time"].as_array().unwrap().iter().map(|time| time.as_f64().unwrap()).collect();
    for of in [0, 1] {
        let angles = data["attitude"][of].as_array().unwrap();
        assert_eq!(angles.len(), times.len());
        let known = |from_s: f64, to_s: f64| {
            let within = times.iter().zip(angles).filter(|(time, _)| (from_s..to_s).contains(*time));
            within.map(|(_, angle)| angle.is_number()).collect::<Vec<_>>()
        };
        assert!(known(1.0, 3.9).iter().chain(&known(5.3, 9.0)).all(|is_known| *is_known));
        let lost = known(4.5, 5.0);
        assert!(!lost.is_empty() && lost.iter().all(|is_known| !is_known));
    }
    // Limp at first, then standing, and in the air at times.
    let contact = data["contact"][0].as_str().unwrap();
    assert!(contact.starts_with('-') && contact.contains('s') && contact.contains('a'));
    assert!(data["goal"][0][0].is_null());
}
