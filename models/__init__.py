"""The models, disturbances and studies that come with Epicycle, in YAML."""
