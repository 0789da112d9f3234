# Two stages: the first builds the release program on Debian 12, the second carries it and the
# libraries it is linked to, and nothing else. BASE may be any Debian 12.
ARG BASE=debian:bookworm-slim

FROM ${BASE} AS build
# A certificate for npm's registry behind a proxy that has its own; empty otherwise.
ARG NODE_EXTRA_CA_CERTS=
WORKDIR /src
COPY scripts scripts
COPY web/package.json web/package-lock.json web/
RUN scripts/setup build web
COPY . .
RUN cmake --preset release -DWINDSPLAT_TESTS=OFF -DWINDSPLAT_WERROR=OFF \
    && cmake --build --preset release --target windsplat \
    && cmake --install build/release --prefix /opt/windsplat --strip

FROM ${BASE}
RUN apt-get -q update \
    && DEBIAN_FRONTEND=noninteractive apt-get -q -y install --no-install-recommends \
        libblosc1 libboost-url1.81.0 libeccodes0 libfmt9 libhwy1 liblz4-1 libnetcdf19 libpng16-16 \
        libprometheus-cpp-core1.0 libpugixml1v5 libseccomp2 libspdlog1.10 libssl3 libstdc++6 libturbojpeg0 \
        libzstd1 zlib1g \
    && rm -rf /var/lib/apt/lists/* /var/cache/apt/* /var/log/apt /var/log/dpkg.log \
    && useradd --system --uid 10001 --user-group --no-create-home --home-dir /nonexistent \
        --shell /usr/sbin/nologin windsplat \
    && install -d -o windsplat -g windsplat -m 0700 /var/lib/windsplat
COPY --from=build /opt/windsplat/bin/windsplat /usr/local/bin/windsplat
# For WINDSPLAT_STATE_DIR: a volume that is put there new belongs to the user from the start.
USER windsplat
EXPOSE 8080
HEALTHCHECK --interval=15s --timeout=5s --start-period=20s --retries=3 \
    CMD ["windsplat", "healthcheck"]
ENTRYPOINT ["windsplat"]
# A container's addresses are all its own, and who reaches them is decided where its port is published:
# to others only with WINDSPLAT_TOKEN_FILE, which makes the flag unneeded (deploy/compose.yaml).
# Without a token it answers for localhost and numeric addresses alone; WINDSPLAT_ALLOW_HOST names others.
CMD ["serve", "--listen", "0.0.0.0:8080", "--allow-remote"]
