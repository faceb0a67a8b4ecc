//! Spans of distributed tracing as plain data, and the W3C trace context that travels with calls and
//! batches. What becomes of an ended span is up to a [`SpanRecorder`].

use std::fmt;
use std::time::SystemTime;

use crate::identity;
use crate::v1;

/// Key of the trace context in the metadata of a call.
pub const TRACEPARENT: &str = "traceparent";
/// Length of a trace context of version 00, bytes.
const TRACEPARENT_BYTES: usize = 55;

/// Position in a trace: that of a span, which may become the parent of others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TraceContext {
    /// Number of the trace, not 0.
    pub trace: u128,
    /// Number of the span, not 0.
    pub span: u64,
    /// Whether the trace is recorded.
    pub sampled: bool,
}

/// Value of an attribute of a span.
#[derive(Debug, Clone, PartialEq)]
pub enum AttributeValue {
    /// A text.
    Text(String),
    /// A count, or the number of a thing.
    Count(u64),
}

/// A span that has begun.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenSpan {
    name: &'static str,
    context: TraceContext,
    parent: Option<TraceContext>,
    start: SystemTime,
    attributes: Vec<(&'static str, AttributeValue)>,
}

/// A span that has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct EndedSpan {
    /// Its name.
    pub name: &'static str,
    /// Its position.
    pub context: TraceContext,
    /// Its parent, if it has one.
    pub parent: Option<TraceContext>,
    /// Its begin.
    pub start: SystemTime,
    /// Its end.
    pub end: SystemTime,
    /// Its attributes.
    pub attributes: Vec<(&'static str, AttributeValue)>,
    /// Why what it stands for did not succeed, if it did not.
    pub error: Option<String>,
}

/// A place for ended spans. It must not wait: it may drop what it has no room for.
pub trait SpanRecorder: fmt::Debug + Send + Sync {
    /// Takes a span.
    fn record(&self, span: EndedSpan);
}

impl TraceContext {
    /// Reads a trace context as W3C defines it; `None` if it is malformed.
    pub fn parse(text: &str) -> Option<Self> {
        let bytes = text.as_bytes();
        // A later version may have more at the end.
        let whole = match bytes.get(..3)? {
            b"00-" => bytes.len() == TRACEPARENT_BYTES,
            b"ff-" => false,
            _ => bytes.get(TRACEPARENT_BYTES).is_none_or(|next| *next == b'-'),
        };
        let [version, trace, span, flags] = [0..2, 3..35, 36..52, 53..55].map(|at| text.get(at));
        let dashes = [2, 35, 52].iter().all(|at| bytes.get(*at) == Some(&b'-'));
        let _version = number(version?)?;
        let trace = number(trace?)?;
        let span = u64::try_from(number(span?)?).ok()?;
        let sampled = number(flags?)? & 1 == 1;
        (whole && dashes && trace != 0 && span != 0).then_some(Self { trace, span, sampled })
    }

    /// Returns the context of a batch that a coordinator has sent; `None` if it has none.
    pub fn of_batch(message: &v1::Batch) -> Option<Self> {
        let v1::BatchTrace { trace_high, trace_low, span } = message.trace?;
        let trace = u128::from(trace_high) << 64 | u128::from(trace_low);
        (trace != 0 && span != 0).then_some(Self { trace, span, sampled: true })
    }

    /// Returns the message of a sampled context.
    pub fn to_message(self) -> v1::BatchTrace {
        let trace_high = (self.trace >> 64) as u64;
        v1::BatchTrace { trace_high, trace_low: self.trace as u64, span: self.span }
    }
}

/// Reads lower-case hexadecimal digits.
fn number(digits: &str) -> Option<u128> {
    let allowed = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
    let all = digits.bytes().all(allowed);
    all.then(|| u128::from_str_radix(digits, 16).ok()).flatten()
}

impl fmt::Display for TraceContext {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "00-{:032x}-{:016x}-{:02x}", self.trace, self.span, u8::from(self.sampled))
    }
}

impl OpenSpan {
    /// Begins a span; without a parent it begins a trace. Returns `None` if the trace of its parent is
    /// not recorded.
    pub fn begin(
        name: &'static str,
        parent: Option<TraceContext>,
        start: SystemTime,
    ) -> Option<Self> {
        // Without random numbers nothing is traced.
        let random = || identity::random_number().ok();
        let trace = match parent {
            Some(TraceContext { sampled: false, .. }) => return None,
            Some(parent) => parent.trace,
            None => u128::from(random()?) << 64 | u128::from(random()?),
        };
        let context = TraceContext { trace, span: random()?, sampled: true };
        Some(Self { name, context, parent, start, attributes: Vec::new() })
    }

    /// Returns its position, for its children.
    pub fn context(&self) -> TraceContext {
        self.context
    }

    /// Adds an attribute.
    pub fn set(&mut self, name: &'static str, value: AttributeValue) {
        self.attributes.push((name, value));
    }

    /// Ends the span.
    pub fn end(self, end: SystemTime, error: Option<String>) -> EndedSpan {
        let Self { name, context, parent, start, attributes } = self;
        EndedSpan { name, context, parent, start, end: end.max(start), attributes, error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXAMPLE: &str = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

    #[test]
    fn a_context_is_read_as_w3c_defines_it() {
        let context = TraceContext::parse(EXAMPLE).unwrap();
        let trace = 0x4bf9_2f35_77b3_4da6_a3ce_929d_0e0e_4736;
        assert_eq!(context, TraceContext { trace, span: 0x00f0_67aa_0ba9_02b7, sampled: true });
        assert_eq!(context.to_string(), EXAMPLE);
        let flags = |flags: &str| EXAMPLE.replace("-01", flags);
        let sampled = |text: &str| TraceContext::parse(text).map(|context| context.sampled);
        assert_eq!(sampled(&flags("-00")), Some(false));
        assert_eq!(sampled(&flags("-03")), Some(true));
        // A later version may have more at the end, this one has not.
        let later = EXAMPLE.replacen("00", "cc", 1);
        assert_eq!(sampled(&later), Some(true));
        assert_eq!(sampled(&format!("{later}-more")), Some(true));
        let malformed = [
            String::new(),
            "00-".to_owned(),
            format!("{EXAMPLE}-more"),
            format!("{later}more"),
            EXAMPLE.replacen("00", "ff", 1),
            EXAMPLE.replace("4bf9", "4BF9"),
            EXAMPLE.replace("4bf9", "+bf9"),
            EXAMPLE.replace("4bf92f3577b34da6a3ce929d0e0e4736", &"0".repeat(32)),
            EXAMPLE.replace("00f067aa0ba902b7", &"0".repeat(16)),
            EXAMPLE.replace('-', "_"),
            EXAMPLE.replace("4736", "47é"),
            EXAMPLE[..54].to_owned(),
        ];
        for text in malformed {
            assert_eq!(TraceContext::parse(&text), None, "{text}");
        }
    }

    #[test]
    fn a_context_survives_a_batch() {
        let context = TraceContext::parse(EXAMPLE).unwrap();
        let with = |trace| v1::Batch { trace, ..v1::Batch::default() };
        assert_eq!(TraceContext::of_batch(&with(Some(context.to_message()))), Some(context));
        assert_eq!(TraceContext::of_batch(&with(None)), None);
        assert_eq!(TraceContext::of_batch(&with(Some(v1::BatchTrace::default()))), None);
    }

    #[test]
    fn children_are_of_the_trace_of_their_parent() {
        let start = SystemTime::UNIX_EPOCH;
        let root = OpenSpan::begin("root", None, start).unwrap();
        let mut child = OpenSpan::begin("child", Some(root.context()), start).unwrap();
        child.set("count", AttributeValue::Count(3));
        let other = OpenSpan::begin("other", None, start).unwrap();
        assert_eq!(child.context().trace, root.context().trace);
        assert_ne!(child.context().span, root.context().span);
        assert_ne!(other.context().trace, root.context().trace);
        let ended = child.end(start, Some("why".to_owned()));
        assert_eq!(ended.parent, Some(root.context()));
        assert_eq!(ended.attributes, [("count", AttributeValue::Count(3))]);
        // A caller that does not record its trace decides for all below it.
        let unsampled = TraceContext { sampled: false, ..root.context() };
        assert_eq!(OpenSpan::begin("none", Some(unsampled), start), None);
    }
}
