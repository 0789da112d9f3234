# Three stages: the first builds the release program on Debian 12, the second installs its libraries
# and collects what it needs, the third contains only that: no shell and no package manager. BASE
# may be any Debian 12 image. VTK is not installed, so that cases of OpenFOAM and EnSight are
# refused.
ARG BASE=debian:bookworm-slim

FROM ${BASE} AS build
# The certificate of a proxy that intercepts npm's registry; empty without one.
ARG NODE_EXTRA_CA_CERTS=
WORKDIR /src
COPY scripts scripts
COPY web/package.json web/package-lock.json web/
RUN scripts/setup build web && apt-get -q -y install --no-install-recommends python3
COPY . .
RUN cmake --preset release -DWINDSPLAT_TESTS=OFF -DWINDSPLAT_WERROR=OFF \
    && cmake --build --preset release --target windsplat \
    && install -D --strip build/release/windsplat /opt/windsplat/bin/windsplat \
    && scripts/sbom >/opt/windsplat/windsplat.cdx.json

FROM ${BASE} AS root
RUN apt-get -q update \
    && DEBIAN_FRONTEND=noninteractive apt-get -q -y install --no-install-recommends \
        ca-certificates libblosc1 libboost-url1.81.0 libcairo2 libcurl4 libeccodes0 libfmt9 \
        libharfbuzz0b liblz4-1 libnetcdf19 libopenh264-7 libpng16-16 libproj25 \
        libprometheus-cpp-core1.0 libpugixml1v5 libseccomp2 \
        libspdlog1.10 libssl3 libstdc++6 libturbojpeg0 libzstd1 zlib1g
COPY --from=build /opt/windsplat /opt/windsplat
COPY scripts/image-root /usr/local/bin/image-root
RUN image-root /opt/windsplat /image

FROM scratch
COPY --from=root /image /
# For WINDSPLAT_STATE_DIR: a new volume mounted at /var/lib/windsplat belongs to the user; so does
# that of the cache of files fetched from other hosts.
ENV PATH=/usr/local/bin WINDSPLAT_DATA_CACHE=/var/cache/windsplat
USER 10001:10001
EXPOSE 8080
HEALTHCHECK --interval=15s --timeout=5s --start-period=20s --retries=3 \
    CMD ["windsplat", "healthcheck"]
ENTRYPOINT ["windsplat"]
# The container listens on all its addresses; the published port determines which machines can reach
# it. Publish it to others only with WINDSPLAT_TOKEN_FILE, which makes the flag unnecessary
# (deploy/compose.yaml). Without a token only localhost and numeric addresses are accepted as Host;
# WINDSPLAT_ALLOW_HOST adds others.
CMD ["serve", "--listen", "0.0.0.0:8080", "--allow-remote"]
