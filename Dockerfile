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
        libboost-url1.81.0 libfmt9 libhwy1 libnetcdf19 libspdlog1.10 libspng0 libstdc++6 \
        libturbojpeg0 \
    && rm -rf /var/lib/apt/lists/* /var/cache/apt/* /var/log/apt /var/log/dpkg.log \
    && useradd --system --uid 10001 --user-group --no-create-home --home-dir /nonexistent \
        --shell /usr/sbin/nologin windsplat
COPY --from=build /opt/windsplat/bin/windsplat /usr/local/bin/windsplat
USER windsplat
EXPOSE 8080
HEALTHCHECK --interval=15s --timeout=5s --start-period=20s --retries=3 \
    CMD ["windsplat", "healthcheck"]
ENTRYPOINT ["windsplat"]
CMD ["serve", "--listen", "0.0.0.0:8080", "--allow-remote"]
