"""The models, one file each; the table that names them is fields.table."""
