# Sourced by ./demo and ./test: says what it does, installs the packages that are missing.
# shellcheck shell=bash

started=$SECONDS
say() { printf '\n[%3d:%02d] %s\n' $(((SECONDS - started) / 60)) $(((SECONDS - started) % 60)) "$*"; }

# need_packages SECTION…: installs what packages.txt lists there and this machine lacks.
need_packages() {
  if ! command -v dpkg-query >/dev/null; then
    say "Not a Debian system: make sure that the packages of packages.txt are there"
    return
  fi
  local section="" line word wanted=() missing=()
  while read -r line; do
    case "$line" in
      '#'* | '') ;;
      '['*) section=${line//[\[\]]/} ;;
      *) case " $* " in *" $section "*) for word in $line; do wanted+=("$word"); done ;; esac ;;
    esac
  done <"$root/packages.txt"
  for word in "${wanted[@]}"; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$word" 2>/dev/null)" = installed ] || missing+=("$word")
  done
  [ ${#missing[@]} -eq 0 ] && return
  say "Installing ${#missing[@]} packages (of ${#wanted[@]} that are needed): ${missing[*]}"
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then as_root=(sudo); fi
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" \
    >"$root/build/packages.log" 2>&1 ||
    { tail -n 20 "$root/build/packages.log"; echo "Packages could not be installed; the lines above say why." >&2; exit 1; }
}

# build PRESET TARGET…: configures once, builds what changed, shows ninja's own progress.
build() {
  local preset=$1
  shift
  say "Building ($preset): $*"
  if [ ! -f "$root/build/$preset/build.ninja" ]; then
    (cd "$root" && cmake --preset "$preset" >"build/$preset.configure.log" 2>&1) ||
      { tail -n 30 "$root/build/$preset.configure.log"; exit 1; }
  fi
  (cd "$root" && cmake --build "build/$preset" --target "$@")
}
mkdir -p "$root/build"
