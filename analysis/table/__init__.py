"""Parameters of any response files, for people who only want that."""

from analysis.table.files import FileResponses, read_responses
from analysis.table.parameters_table import tabulate_files, write_table

__all__ = ["FileResponses", "read_responses", "tabulate_files", "write_table"]
