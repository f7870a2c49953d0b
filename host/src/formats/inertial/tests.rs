use super::*;
use std::fs;
use tempfile::TempDir;

/// A table's text with a heading: 200 Hz from `begin`, in units of so many a second.
fn table(heading: &str, separator: &str, per_second: f64) -> String {
    let row = |at: u32| {
        let time = (f64::from(at) * 0.005 * per_second).to_string();
        let turn = 0.01 * f64::from(at);
        let cells = [time, turn.to_string(), "0.02".into(), "-0.03".into()];
        let force = ["0.1", "-0.2", "9.8"].map(str::to_owned);
        [cells.as_slice(), force.as_slice()].concat().join(separator)
    };
    let rows: Vec<String> = (0..20).map(row).collect();
    format!("{heading}\n{}\n", rows.join("\n"))
}

fn read(text: impl AsRef<[u8]>) -> Result<InertialTable, String> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("imu.csv");
    fs::write(&path, text).unwrap();
    read_inertial(&path).map_err(|error| error.to_string())
}

const PLAIN: &str = "time,wx,wy,wz,ax,ay,az";

fn assert_is_plain(read: &InertialTable, what: &str) {
    assert_eq!(read.readings.len(), 20, "{what}");
    let third = read.readings[2];
    assert!((third.time_ns - read.readings[0].time_ns - 10_000_000).abs() < 2, "{what}: {third:?}");
    for (found, expected) in third.turn_rate.iter().zip([0.02, 0.02, -0.03]) {
        assert!((found - expected).abs() < 1e-9, "{what}: {third:?}");
    }
    for (found, expected) in third.force.iter().zip([0.1, -0.2, 9.8]) {
        assert!((found - expected).abs() < 1e-9, "{what}: {third:?}");
    }
}

#[test]
fn tables_of_every_tool_give_the_same_samples() {
    for (heading, separator, per_second) in [
        (PLAIN, ",", 1.0),
        ("time_s,wx,wy,wz,ax,ay,az", ",", 1.0),
        ("# a car\n# time wx wy wz ax ay az", " ", 1.0),
        ("t;gyro_x;gyro_y;gyro_z;acc_x;acc_y;acc_z", ";", 1e3),
        (
            "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x \
             [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]",
            ",",
            1e9,
        ),
        (
            "\"Time (s)\",\"Gyroscope x (rad/s)\",\"Gyroscope y (rad/s)\",\"Gyroscope z (rad/s)\",\
             \"Acceleration x (m/s^2)\",\"Acceleration y (m/s^2)\",\"Acceleration z (m/s^2)\"",
            ",",
            1.0,
        ),
        ("timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z", ",", 1e9),
        ("timestamp_us\tgx\tgy\tgz\tax\tay\taz", "\t", 1e6),
    ] {
        assert_is_plain(&read(table(heading, separator, per_second)).unwrap(), heading);
    }
    // A heading with more columns, in another order, one of them a message's own stamp.
    let text = (0..20).fold(
        "%time,field.header.seq,field.header.stamp,field.orientation.w,\
         field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z,\
         field.angular_velocity_covariance0,field.linear_acceleration.x,\
         field.linear_acceleration.y,field.linear_acceleration.z\n"
            .to_owned(),
        |text, at| {
            let (stamp, turn) = (1_500_000_000_000_000_000u64 + at * 5_000_000, at as f64 * 0.01);
            format!(
                "{text}{},{at},{stamp},1,{turn},0.02,-0.03,7,0.1,-0.2,9.8\n",
                stamp + 900_000 * at
            )
        },
    );
    let found = read(text).unwrap();
    assert_is_plain(&found, "rostopic");
    assert_eq!(found.readings[0].time_ns, 1_500_000_000_000_000_000);
}

#[test]
fn units_in_a_heading_are_converted_and_unnamed_ones_are_doubted() {
    let degrees = "time_s,wx_deg_s,wy [deg/s],wz [dps],ax_g,ay [g],az (mg)";
    let row =
        |at: u32| format!("{},{},90,-180,0,0,1000\n", f64::from(at) * 0.005, 45.0 * f64::from(at));
    let text: String = (0..4).map(row).collect();
    let found = read(format!("{degrees}\n{text}")).unwrap();
    let [x, y, z] = found.readings[1].turn_rate;
    let quarter = std::f64::consts::FRAC_PI_4;
    assert!((x - quarter).abs() < 1e-9 && (y - 2.0 * quarter).abs() < 1e-9, "{x} {y}");
    assert!((z + 4.0 * quarter).abs() < 1e-9);
    assert!((found.readings[1].force[2] - 9.806_65).abs() < 1e-9);
    // Without units what no sensor measures is refused, with the next action.
    for (from, to, expected) in [
        ("9.8", "0.98", "they are in g"),
        ("9.8", "980", "thousandths of g"),
        ("9.8", "0.0", "gravity is taken out"),
        ("9.8", "98", "another unit, or the sensor is saturated"),
        ("-0.03", "-90", "degrees a second"),
    ] {
        let error = read(table(PLAIN, ",", 1.0).replace(&format!(",{from}"), &format!(",{to}")));
        let error = error.unwrap_err();
        assert!(error.contains(expected), "{to}: {error}");
    }
    let error = read(format!("time,wx [furlongs],wy,wz,ax,ay,az\n{text}")).unwrap_err();
    assert!(error.contains("no column wx"), "{error}");
}

#[test]
fn text_of_other_systems_is_the_same() {
    let text = table(PLAIN, ",", 1.0);
    let utf16: Vec<u8> =
        "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    for bytes in [
        format!("\u{feff}{text}").into_bytes(),
        text.replace('\n', "\r\n").into_bytes(),
        text.replace('\n', "\r").into_bytes(),
        format!("{text}\n\n# the end\n").into_bytes(),
        utf16,
    ] {
        assert_is_plain(&read(&bytes).unwrap(), &String::from_utf8_lossy(&bytes[..12]));
    }
    let commas = table(PLAIN, ";", 1.0).replace('.', ",");
    assert_is_plain(&read(commas.replacen(PLAIN, &PLAIN.replace(',', ";"), 1)).unwrap(), "commas");
}

#[test]
fn what_is_missing_is_named() {
    let text = table(PLAIN, ",", 1.0);
    let refused = |text: String| read(text).unwrap_err();
    let error = refused(text.replacen("wz", "roll", 1));
    assert!(error.contains("no column wz; it has time, wx, wy, roll"), "{error}");
    let error = refused(text.replacen("wz", "wy", 1));
    assert!(error.contains("columns wy and wy are both the turn rate about y"), "{error}");
    let error = refused(text.replacen("time", "frame", 1));
    assert!(error.contains("no column time"), "{error}");
    assert!(refused(String::new()).contains("it has no rows"));
    assert!(refused(format!("{PLAIN}\n")).contains("it has no rows"));
    assert!(refused("1 2 3\n4 5 6\n".into()).contains("3 columns without a heading"));
    let error = refused(format!("{PLAIN}\n0,0,0,0,0,0,9.8\n"));
    assert!(error.contains("1 inertial samples of different times"), "{error}");
    // A row that is not whole in the middle of a file, a word, an empty cell.
    for (from, to, expected) in [
        ("0.01,0.05,0.02,-0.03,0.1,-0.2,9.8", "0.01,0.05,0.02", "line 7 has 3 columns"),
        (",0.05,", ",fast,", "line 7 has \"fast\" in column 2"),
        (",0.05,", ",,", "line 7 has 7 columns, and column 2 is missing"),
    ] {
        let text = text.replace("0.025,", "0.01,").replace(from, to);
        let error = refused(text);
        assert!(error.contains(expected), "{error}");
    }
    let folder = TempDir::new().unwrap();
    let error = read_inertial(folder.path()).unwrap_err().to_string();
    assert!(error.contains("holds no inertial samples"), "{error}");
    let error = read_inertial(&folder.path().join("none.csv")).unwrap_err().to_string();
    assert!(error.contains("cannot be read"), "{error}");
}

#[test]
fn a_table_without_a_heading_is_read_in_euroc_s_order_and_said() {
    let text = table("", ",", 1e9);
    let found = read(text.trim_start()).unwrap();
    assert_is_plain(&found, "no heading");
    let notes = found.notes.join("; ");
    assert!(notes.contains("taken as time,wx,wy,wz,ax,ay,az"), "{notes}");
    assert!(notes.contains("times are in ns"), "{notes}");
}

#[test]
fn times_are_put_in_order_and_all_that_is_left_out_is_counted() {
    let mut lines: Vec<String> = table(PLAIN, ",", 1.0).lines().map(str::to_owned).collect();
    let whole = read(lines.join("\n")).unwrap();
    assert_eq!(whole.notes, Vec::<String>::new());
    assert!((whole.rate_hz() - 200.0).abs() < 1e-6);
    lines.swap(5, 6);
    lines.insert(9, lines[9].replace("0.1,", "0.7,"));
    lines.insert(11, "0.0421,nan,0,0,0,0,9.8".into());
    lines.push("0.1,0.3,0.0".into());
    let found = read(lines.join("\n")).unwrap();
    // The first of two equal times stays, which is the one put in.
    let force = found.readings[8].force;
    let mut expected = whole.readings.clone();
    expected[8].force = force;
    assert_eq!(found.readings, expected);
    let notes = found.notes.join("; ");
    for part in [
        "its last row is cut off: left out",
        "1 samples are not finite numbers: left out",
        "1 samples come before their predecessor: sorted by time",
        "1 samples repeat the time of another: the first of each is kept",
    ] {
        assert!(notes.contains(part), "{part}: {notes}");
    }
    // Most are not numbers.
    let text = (0..9).fold(format!("{PLAIN}\n"), |text, at| {
        format!("{text}{at},{},0,0,0,0,9.8\n", if at < 3 { "0.1" } else { "nan" })
    });
    let error = read(text).unwrap_err();
    assert!(error.contains("6 of its 9 samples are not numbers"), "{error}");
}

#[test]
fn gaps_and_a_stuck_unit_are_said() {
    let rows = |turn: &dyn Fn(u32) -> f64| {
        (0..40u32).fold(format!("{PLAIN}\n"), |text, at| {
            let time = f64::from(at) * 0.01 + if at >= 20 { 0.25 } else { 0.0 };
            format!("{text}{time},{},0,0,0,0,9.8\n", turn(at))
        })
    };
    let found = read(rows(&|at| f64::from(at) * 0.01)).unwrap();
    assert!((found.longest_gap_s() - 0.26).abs() < 1e-9);
    let notes = found.notes.join("; ");
    assert!(notes.contains("1 gaps between inertial samples, the longest 0.26 s"), "{notes}");
    assert!(!notes.contains("stuck"), "{notes}");
    let notes = read(rows(&|_| 0.25)).unwrap().notes.join("; ");
    assert!(notes.contains("39 of 40 samples repeat the turn rate before them"), "{notes}");
}

/// KITTI raw's folder with so many samples at 100 Hz.
fn oxts(samples: usize) -> TempDir {
    let folder = TempDir::new().unwrap();
    let data = folder.path().join("oxts/data");
    fs::create_dir_all(&data).unwrap();
    let mut times = String::new();
    for at in 0..samples {
        let numbers: Vec<String> = (0..30).map(|number| format!("{}", number + at)).collect();
        let text = numbers.join(" ").replace(&format!(" {} ", 13 + at), " 9.8 ");
        fs::write(data.join(format!("{at:010}.txt")), text).unwrap();
        times += &format!("2011-09-26 14:05:00.{:09}\n", at * 10_000_000);
    }
    fs::write(folder.path().join("oxts/timestamps.txt"), times).unwrap();
    folder
}

#[test]
fn kitti_s_oxts_are_read_by_their_numbers_and_missing_files_are_said() {
    let folder = oxts(6);
    // Accelerations of these numbers are those of no car: the axes alone are looked at.
    for path in [folder.path().to_path_buf(), folder.path().join("oxts")] {
        let error = read_inertial(&path).unwrap_err().to_string();
        assert!(error.contains("in another unit"), "{error}");
    }
    for at in 0..6 {
        let mut numbers = vec!["0".to_owned(); 30];
        for (position, value) in [(11, "0.5"), (12, "0.25"), (13, "9.8"), (17, "0.1"), (19, "0.3")]
        {
            numbers[position] = value.to_owned();
        }
        numbers[18] = format!("0.{at}");
        let file = folder.path().join(format!("oxts/data/{at:010}.txt"));
        fs::write(file, numbers.join(" ")).unwrap();
    }
    fs::remove_file(folder.path().join("oxts/data/0000000002.txt")).unwrap();
    fs::write(folder.path().join("oxts/data/0000000004.txt"), "1 2 3").unwrap();
    fs::write(folder.path().join("oxts/data/0000000009.txt"), "1 2 3").unwrap();
    let found = read_inertial(folder.path()).unwrap();
    assert_eq!(found.format, "KITTI oxts");
    let rates: Vec<f64> = found.readings.iter().map(|reading| reading.turn_rate[1]).collect();
    assert_eq!(rates, [0.0, 0.1, 0.3, 0.5]);
    assert_eq!(found.readings[0].force, [0.5, 0.25, 9.8]);
    assert_eq!(found.readings[0].time_ns, 1_317_045_900_000_000_000);
    assert_eq!(found.readings[2].time_ns - found.readings[0].time_ns, 30_000_000);
    let notes = found.notes.join("; ");
    assert!(notes.contains("1 files have no line in timestamps.txt"), "{notes}");
    assert!(notes.contains("1 files do not hold KITTI's thirty numbers"), "{notes}");
}
