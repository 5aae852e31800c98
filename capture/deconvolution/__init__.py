"""Responses from recorded sweeps, without a session: arrays, files, takes."""
