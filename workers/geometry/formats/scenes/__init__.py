"""What formats of scenes share: placed objects, and what slicers mean by them."""
