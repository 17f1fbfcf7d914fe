"""What every table of a case file is."""

from pydantic import BaseModel, ConfigDict


class Table(BaseModel):
    """A table of a case file: frozen, and every key in it must be known."""

    model_config = ConfigDict(extra="forbid", frozen=True)
