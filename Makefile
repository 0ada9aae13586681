# make draw: the first picture. make test: every test. See CONTRIBUTING.md for the rest.
CARGO ?= cargo
SCENARIO ?= scenarios/first_light.toml

.PHONY: draw test lint fmt guide bench experiments clean driver

BINARY = $(or $(CARGO_TARGET_DIR),target)/release/calamus

draw: driver
	@echo "building; the first time takes some minutes"
	$(CARGO) build --release --bin calamus
	$(BINARY) run $(SCENARIO)
	@echo "the picture is out/$(basename $(notdir $(SCENARIO)))/drawing.png, the report out/$(basename $(notdir $(SCENARIO)))/report.html"
	@echo "the program is $(abspath $(BINARY)); next:"
	@echo "    $(BINARY) run letter"

test: driver
	$(CARGO) test --quiet --workspace --features onnx --lib --bins --tests

lint:
	$(CARGO) fmt --check
	$(CARGO) clippy --workspace --all-targets --quiet -- -D warnings
	$(CARGO) clippy --workspace --all-targets --features onnx --quiet -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --workspace --features onnx --no-deps --quiet

fmt:
	$(CARGO) fmt

# The tables of GUIDE.md, from the fields of scenarios, experiments and metrics.json.
guide:
	$(CARGO) run --quiet --example guide

bench:
	$(CARGO) bench

# Every experiment in scenarios/experiments/, one after another.
experiments: driver
	@set -e; found=no; for f in scenarios/experiments/*.toml; do \
		[ -e "$$f" ] || continue; found=yes; \
		$(CARGO) run --release -- experiment "$$f" --out "out/experiments/$$(basename "$$f" .toml)"; \
	done; [ $$found = yes ] || echo "there are no experiments in scenarios/experiments/ yet"

clean:
	$(CARGO) clean
	rm -rf out

driver:
	@scripts/ensure-gpu-driver.sh
