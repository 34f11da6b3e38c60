//! The one place that looks at the clock.

use std::time::{SystemTime, UNIX_EPOCH};

/// Returns the time of this run as `YYYY-MM-DD at HH:MM:SS`, UTC.
///
/// `SOURCE_DATE_EPOCH` (seconds since 1970), where it is set, makes programs reproducible:
/// <https://reproducible-builds.org/specs/source-date-epoch/>.
#[must_use]
pub fn now() -> String {
    let fixed = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|text| text.parse().ok());
    let seconds = fixed.unwrap_or_else(|| {
        // A clock before 1970 is as good as none.
        SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
    });
    timestamp(seconds)
}

/// Civil date from days since 1970 by the algorithm of H. Hinnant,
/// <https://howardhinnant.github.io/date_algorithms.html#civil_from_days>, for dates after 1970.
fn timestamp(seconds: u64) -> String {
    // Year 9999 is the last with four digits.
    let seconds = seconds.min(253_402_300_799);
    let (days, second_of_day) = (seconds / 86_400, seconds % 86_400);
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    let (hour, minute, second) =
        (second_of_day / 3600, second_of_day / 60 % 60, second_of_day % 60);
    format!("{year:04}-{month:02}-{day:02} at {hour:02}:{minute:02}:{second:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_dates() {
        assert_eq!(timestamp(0), "1970-01-01 at 00:00:00");
        assert_eq!(timestamp(951_782_400), "2000-02-29 at 00:00:00");
        assert_eq!(timestamp(1_795_305_599), "2026-11-21 at 23:59:59");
        assert_eq!(timestamp(u64::MAX), "9999-12-31 at 23:59:59");
    }
}
