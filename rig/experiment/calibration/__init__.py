"""What a bench does, and a person is asked, while an instrument is compared with a reference."""
