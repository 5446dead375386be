# The environment of ./hvi as an image: Debian 13's own packages by the list in .ci/packages, and this package.
#   docker build -t hvi_fenicsx:0.1.0 --build-arg REVISION="$(git rev-parse HEAD)" .
#   docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/work" hvi_fenicsx:0.1.0 run scene.toml
FROM debian:trixie-slim

# The sections of .ci/packages to install; the launcher adds "tests".
ARG SECTIONS="run"
COPY .ci/packages /usr/local/share/hvi/packages
RUN apt-get update -q \
    && awk -v wanted=" $SECTIONS " '/^\[/ { on = index(wanted, " " substr($1, 2, length($1) - 2) " "); next } on && /^[a-z0-9]/ { print $1 }' \
        /usr/local/share/hvi/packages \
        | DEBIAN_FRONTEND=noninteractive xargs apt-get install -y -q --no-install-recommends \
    && apt-get clean && rm -rf /var/lib/apt/lists/*

# PYTHONPATH rather than pip: nothing has to be built, and a mounted copy of the repository may take the place of this one.
COPY hvi_fenicsx /opt/hvi_fenicsx/hvi_fenicsx
ENV PYTHONPATH=/opt/hvi_fenicsx \
    HVI_INSIDE=image \
    HOME=/home/hvi \
    XDG_CACHE_HOME=/home/hvi/.cache \
    LANG=C.UTF-8 \
    OMP_NUM_THREADS=1 \
    OMPI_MCA_btl=^tcp,ofi \
    OMPI_ALLOW_RUN_AS_ROOT=1 \
    OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
    PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe \
    PRTE_MCA_mapby=:oversubscribe

# The commit, which `hvi version` and every summary name.
ARG REVISION=""
ENV HVI_REVISION=$REVISION
LABEL org.opencontainers.image.revision=$REVISION org.opencontainers.image.licenses=MIT

# Whoever the caller is (--user), home and caches are writable, so that results in /work belong to the caller.
RUN printf '#!/bin/sh\nexec python3 -P -m hvi_fenicsx "$@"\n' >/usr/local/bin/hvi \
    && chmod 755 /usr/local/bin/hvi \
    && python3 -m compileall -q /opt/hvi_fenicsx \
    && useradd --create-home --uid 1000 hvi \
    && mkdir -p /home/hvi/.cache /work \
    && chmod 1777 /home/hvi /home/hvi/.cache /work

USER hvi
WORKDIR /work
ENTRYPOINT ["hvi"]
CMD ["--help"]
