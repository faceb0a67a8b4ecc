//! Derivatives of the models, by central differences. All points have the same germs, so that the
//! differences are not noise.

use std::sync::Arc;

use tokio::task::JoinSet;

use super::functions::{ModelValue, ServedJob};
use super::model::ServedModel;
use super::protocol_error::ProtocolError;
use super::request_config::RequestConfig;

/// Step of the differences, relative to the size of an input.
const STEP: f64 = 1e-3;

/// A model at an input, whose derivatives are wanted.
#[derive(Debug, Clone)]
pub(super) struct Differentiated {
    pub(super) served: Arc<ServedJob>,
    pub(super) model: ServedModel,
    pub(super) config: RequestConfig,
    pub(super) input: Vec<f64>,
}

impl Differentiated {
    /// Returns the product of a vector with the Jacobian: the gradient of its product with the output.
    pub(super) async fn gradient(self, sens: &[f64]) -> Result<Vec<f64>, ProtocolError> {
        let size = self.input.len();
        // Dropping the set, if a column fails or the request is gone, ends the others.
        let mut tasks = JoinSet::new();
        for k in 0..size {
            let of_column = self.clone();
            let direction = (0..size).map(|j| if j == k { 1.0 } else { 0.0 }).collect();
            tasks.spawn(async move { (k, of_column.along(direction).await) });
        }
        let mut gradient = vec![0.0; size];
        while let Some(ended) = tasks.join_next().await {
            let (k, column) = ended.map_err(|_| ProtocolError::output("an evaluation failed"))?;
            gradient[k] = column?.iter().zip(sens).map(|(slope, weight)| slope * weight).sum();
        }
        Ok(gradient)
    }

    /// Returns the product of the Jacobian with a vector.
    pub(super) async fn along(self, direction: Vec<f64>) -> Result<Vec<f64>, ProtocolError> {
        let sizes = self.served.space(self.model, &self.config)?.sizes(&self.input);
        let relative = direction.iter().zip(&sizes).map(|(part, size)| part.abs() / size);
        let longest = relative.fold(0.0, f64::max);
        if longest == 0.0 {
            // The input has to be valid all the same.
            self.served.value(self.model, &self.config, &self.input).await?;
            return Ok(vec![0.0; self.model.outputs()]);
        }
        let step = STEP / longest;
        let beside = |step: f64| {
            self.input.iter().zip(&direction).map(|(at, part)| at + step * part).collect()
        };
        let (above, below) = tokio::join!(self.at(beside(step)), self.at(beside(-step)));
        let slope = |high: &[f64], low: &[f64], width: f64| {
            high.iter().zip(low).map(|(high, low)| (high - low) / width).collect()
        };
        match (above?, below?) {
            (Some(above), Some(below)) => Ok(slope(&above, &below, 2.0 * step)),
            (above, below) => match (self.at(self.input.clone()).await?, above, below) {
                (Some(here), Some(above), _) => Ok(slope(&above, &here, step)),
                (Some(here), None, Some(below)) => Ok(slope(&here, &below, step)),
                (_, _, _) if self.model == ServedModel::Posterior => Ok(vec![0.0]),
                (None, _, _) => Err(self.refusal().await),
                (Some(_), None, None) => Err(ProtocolError::output(format!(
                    "the model has no derivative here: it is not defined at a distance of {step:?} \
                     times the direction on either side"
                ))),
            },
        }
    }

    /// Returns the output at an input; `None` if the model has no value there.
    async fn at(&self, input: Vec<f64>) -> Result<Option<Vec<f64>>, ProtocolError> {
        match self.served.value_within(self.model, &self.config, &input).await {
            Ok(ModelValue { output, .. }) => Ok(Some(output)),
            Err(error) if error.no_value => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Returns why the model has no value at the input itself.
    async fn refusal(&self) -> ProtocolError {
        let found = self.served.value_within(self.model, &self.config, &self.input).await;
        found.err().unwrap_or_else(|| ProtocolError::output("the model has no derivative here"))
    }
}
