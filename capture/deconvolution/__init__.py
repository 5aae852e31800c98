"""capture/deconvolution."""
