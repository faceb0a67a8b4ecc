//! Metrics as text, in the Prometheus text format 0.0.4.

use std::fmt;

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, MetricEncoder, NoLabelSet, prometheus_text};
use prometheus_client::metrics::MetricType;
use prometheus_client::registry::Registry;

use super::families::{Label, MetricFamily, Values};

/// Type of the text, for the header of an answer.
pub(crate) use prometheus_client::encoding::prometheus_text::CONTENT_TYPE;

/// Returns metrics as text.
///
/// # Errors
/// Never, as writing to a string does not fail.
pub(crate) fn text(families: Vec<MetricFamily>) -> Result<String, fmt::Error> {
    let mut registry = Registry::default();
    registry.register_collector(Box::new(AllFamilies(families)));
    let mut text = String::new();
    prometheus_text::encode(&mut text, &registry)?;
    Ok(text)
}

#[derive(Debug)]
struct AllFamilies(Vec<MetricFamily>);

impl Collector for AllFamilies {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> fmt::Result {
        for MetricFamily { name, help, values } in &self.0 {
            let kind = match values {
                Values::Counter(_) => MetricType::Counter,
                Values::Gauge(_) => MetricType::Gauge,
                Values::Histogram(_) => MetricType::Histogram,
            };
            let mut metric = encoder.encode_descriptor(name, help, None, kind)?;
            match values {
                Values::Counter(values) => {
                    encode_labelled(&mut metric, values, |metric, value| {
                        metric.encode_counter::<NoLabelSet, f64, u64>(value, None)
                    })?;
                }
                Values::Gauge(values) => {
                    encode_labelled(&mut metric, values, |metric, value| {
                        metric.encode_gauge(value)
                    })?;
                }
                Values::Histogram(times) => {
                    let buckets: Vec<(f64, u64)> = times.buckets().collect();
                    metric.encode_histogram::<NoLabelSet>(
                        times.sum_s(),
                        times.count(),
                        &buckets,
                        None,
                    )?;
                }
            }
        }
        Ok(())
    }
}

fn encode_labelled(
    metric: &mut MetricEncoder<'_>,
    values: &[(Label, f64)],
    encode: impl Fn(&mut MetricEncoder<'_>, &f64) -> fmt::Result,
) -> fmt::Result {
    for (label, value) in values {
        match label {
            None => encode(metric, value)?,
            Some(label) => encode(&mut metric.encode_family(&[*label])?, value)?,
        }
    }
    Ok(())
}
