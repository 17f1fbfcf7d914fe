"""Files made from an archive: drawings, schedules, models, pictures and the report. It reads results, no more."""
