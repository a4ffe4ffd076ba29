"""RESTIR: light paths resampled in space and time. One module a step; what every technique shares stands in
`reservoir`, `mis`, `resample`, `neighbours` and `motion`."""
