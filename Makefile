# One target per stage of the pipeline, and the chores. `make` alone lists them.
#
#   make nightly                                   the main job on the pipeline pipelines/harv
#   make nightly PIPELINE=mine                     on pipelines/mine
#   make trend ARCHIVE='flights/*.parquet' THREADS=1

PIPELINE ?= harv
# Of make simulate and make next.
CARDS ?= pipelines/$(PIPELINE)/cards.yaml
OUT ?= data/simulation/campaign
# Of make show: FLIGHT or MANEUVER, an id as in the table maneuvers.
shown = $(if $(MANEUVER),maneuver '$(MANEUVER)',$(if $(FLIGHT),flight '$(FLIGHT)'))

# Options of harvest where they are set; otherwise the pipeline's settings apply.
options = \
	$(if $(ARCHIVE),--archive '$(ARCHIVE)') \
	$(if $(WIND_TUNNEL),--wind-tunnel '$(WIND_TUNNEL)') \
	$(if $(EVENTS),--events '$(EVENTS)') \
	$(if $(AGAINST),--against '$(AGAINST)') \
	$(if $(STORE),--store '$(STORE)') \
	$(if $(REPORTS),--reports '$(REPORTS)') \
	$(if $(THREADS),--threads '$(THREADS)') \
	$(if $(MEMORY_MB),--memory-mb '$(MEMORY_MB)')
# Of the targets that run stages: make nightly WAIT=3600 LOG=nightly.jsonl
running = $(if $(WAIT),--wait '$(WAIT)') $(if $(LOG),--log '$(LOG)')

harvest = cargo run --release --locked --quiet -- $(1) '$(PIPELINE)' $(options)

.DEFAULT_GOAL := help
# Stages share a store: one at a time, also under make -j.
.NOTPARALLEL:
.PHONY: cluster object-store supply-chain status explain diff verify gc doc docs torture fuzz ingest segment estimate model trend qualities match match-study compare report export next next-study nightly check show shown simulate validate build test same bench count lint clean help init import install

ingest: build ## read the archive: channels to signals on one clock, repairs, checks of units and signs
	$(call harvest,ingest) $(running)

segment: build ## find the maneuvers and their classes
	$(call harvest,segment) $(running)

estimate: build ## estimate the derivatives of every maneuver
	$(call harvest,estimate) $(running)

model: build ## fuse tunnel and flights to the posterior of every derivative
	$(call harvest,model) $(running)

trend: build ## fit least-squares trends across angle of attack
	$(call harvest,trend) $(running)

qualities: build ## judge the flying qualities of the posterior, with the probability of each level
	$(call harvest,qualities) $(running)

match: build ## fly every maneuver again by a simulator, and judge the match by tolerances
	$(call harvest,match) $(running)

compare: build ## compare the posterior and each maneuver with the wind tunnel, and trends with earlier campaigns
	$(call harvest,compare) $(running)

report: build ## write the report
	$(call harvest,report) $(running)

export: build ## write the flight-updated derivatives for simulators: DAVE-ML, JSBSim, CSV, Parquet
	$(call harvest,export) $(if $(WAIT),--wait '$(WAIT)')

next: build ## the cards of the next flight of MINUTES=45 [GOAL=goals.yaml], with a page for the kneeboard
	$(call harvest,next) --minutes '$(or $(MINUTES),45)' --cards '$(CARDS)' $(if $(GOAL),--goal '$(GOAL)')

nightly: build ## the main job: every stage, to the report
	$(call harvest,run) $(running)

init: build ## draft the pipeline NAME from the recordings FROM
	$(if $(and $(NAME),$(FROM)),,$(error make init NAME=<pipeline> FROM=<file or folder>))
	cargo run --release --locked --quiet -- init '$(NAME)' --from $(FROM)

import: build ## write the recordings FROM (CSV, MATLAB, tall Parquet) as Parquet into the folder TO [NAMES='time [s], …'] [STEP=0.02]
	$(if $(and $(TO),$(FROM)),,$(error make import FROM=<files or folder> TO=<folder>))
	cargo run --release --locked --quiet -- import $(FROM) --to '$(TO)' $(if $(NAMES),--names '$(NAMES)') $(if $(STEP),--step $(STEP))

check: build ## check the configuration and print what a run would do
	$(call harvest,check)

status: build ## fresh, stale and failed artefacts by stage, and why
	$(call harvest,status)

explain: shown build ## origin, fit and dependencies of MANEUVER
	cargo run --release --locked --quiet -- explain '$(MANEUVER)' '$(PIPELINE)' $(options)

diff: build ## changes since the night before, and their causes
	$(call harvest,diff)

verify: build ## compare published bytes, input, configuration and code with the lineage
	$(call harvest,verify)

gc: build ## list what nothing published needs; with YES=1 remove it
	$(call harvest,gc) $(if $(YES),--yes)

show: shown build ## a strip chart of FLIGHT or MANEUVER, SVG, into the folder show of the reports
	cargo run --release --locked --quiet -- show $(shown) '$(PIPELINE)' $(options)

simulate: build ## fly the test cards CARDS into OUT: archive, wind-tunnel database and truth
	cargo run --release --locked --quiet -- lab simulate '$(CARDS)' --out '$(OUT)' $(if $(THREADS),--threads '$(THREADS)')

validate: build ## measure the coverage of the bounds by Monte Carlo: docs/coverage.md (takes long)
	cargo run --release --locked --quiet -- lab validate '$(CARDS)' --out data/simulation/validation --page docs/coverage.md \
		$(if $(REALISATIONS),--realisations '$(REALISATIONS)') $(if $(THREADS),--threads '$(THREADS)')

# Checks before the build that a flight or maneuver is named.
shown:
	$(if $(shown),@:,$(error make show FLIGHT=<flight_id>, or make show MANEUVER=<maneuver_id>))

# A step of its own, so that the long first build shows its progress.
# The bar counts crates on a terminal and in a log alike.
build: ## build the binary (the first time takes minutes)
	CARGO_TERM_PROGRESS_WHEN=always CARGO_TERM_PROGRESS_WIDTH=100 cargo build --release --locked

PREFIX ?= /usr/local
install: build ## install program, man pages and shell completions under PREFIX
	install -D -m 755 "$(or $(CARGO_TARGET_DIR),target)/release/harvest" "$(DESTDIR)$(PREFIX)/bin/harvest"
	"$(DESTDIR)$(PREFIX)/bin/harvest" manual --to "$(DESTDIR)$(PREFIX)"

test: ## run the tests and name the ten slowest [PROFILE=release: of the code that users run]
	FEATURES='$(FEATURES)' PROFILE='$(PROFILE)' bash tests/run.sh

same: ## are the published tables those of the revision SINCE, byte for byte
	bash tests/same_tables.sh '$(SINCE)'

doc: ## the documentation of the code, private items included, into target/doc
	cargo doc --locked --no-deps --document-private-items

docs: ## write docs/tables.md and docs/settings.md from the declarations of tables and settings
	HARVEST_WRITE_DOCS=1 cargo test --locked --lib --quiet -- the_page_of_

# Of make torture and make fuzz: others each time; the output names it.
SEED ?= $(shell date +%s)
KILLS ?= 200
FLIPS ?= 200
torture: ## kill runs at KILLS random moments, flip bits, fill the disk, race; the bytes must be those of an undisturbed run
	HARVEST_SEED='$(SEED)' HARVEST_KILLS='$(KILLS)' HARVEST_FLIPS='$(FLIPS)' cargo test --locked --test stages -- nights:: --nocapture

cluster: build ## a campaign on a Slurm of this machine's own: plain, with a failing task, with a killed node
	bash tests/cluster/slurm.sh target/release/harvest

object-store: ## archive and store in an object store: the tests on an S3-compatible server of this machine's own
	HARVEST_S3_SERVER=$$(bash tests/cluster/s3_server.sh) FEATURES=s3 bash tests/run.sh object_store::

FILES ?= 5000
fuzz: ## FILES spoiled flights, and as many spoiled YAML and CSV files
	HARVEST_SEED='$(SEED)' HARVEST_FUZZ='$(FILES)' cargo test --locked --test stages -- fuzz:: --nocapture

match-study: ## are the probabilities of the proof of match calibrated, over 540 simulated maneuvers
	cargo test --release --locked --lib -- --ignored proof_of_match::

next-study: ## are the bounds that plans predict kept, how many minutes do they save, and do intervals of flying qualities hold, in simulated campaigns
	cargo test --release --locked --lib -- --ignored --nocapture flight_plan::

bench: ## run the benchmarks
	cargo bench --locked --features polars-reader

count: build ## count the instructions of six cases into docs/performance.md
	bash tests/count.sh "$(or $(CARGO_TARGET_DIR),target)/release/harvest"

lint: ## formatting and lints, as .ci/run has them
	cargo fmt --check
	cargo clippy --all-targets --features s3,polars-reader --locked -- -D warnings

supply-chain: ## advisories, licences, sources and duplicate versions of the dependencies, by cargo-deny
	bash tests/supply_chain.sh

clean: ## remove what runs made: data/store and the folders under reports (cargo clean removes the build)
	rm -rf data/store reports/*/

help: ## this list
	@echo 'make TARGET [PIPELINE=harv] [ARCHIVE=] [WIND_TUNNEL=] [EVENTS=] [AGAINST=] [STORE=] [REPORTS=] [THREADS=] [MEMORY_MB=]'
	@echo
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  %-12s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))
	@echo
	@echo 'stages also take [WAIT=seconds for another run] [LOG=file]; make explain takes MANEUVER='
	@echo 'make show takes FLIGHT= or MANEUVER=, an id as in the table maneuvers'
	@echo 'make simulate takes [CARDS=$(CARDS)] [OUT=$(OUT)]; then for instance'
	@echo '  make nightly ARCHIVE=$(OUT)/flights WIND_TUNNEL=$(OUT)/wind_tunnel.csv STORE=data/store/simulated REPORTS=reports/simulated'
	@echo 'make next takes [MINUTES=45] [CARDS=$(CARDS)] [GOAL=]'
	@echo
	@echo 'Every stage first brings its predecessors up to date; what is up to date is not done again.'
	@echo 'make ends with "Error 2" when harvest ran and rejected something (a flight, a maneuver): the tables and'
	@echo 'the report are there, and the report says what and why. "Error 1": it could not run.'
