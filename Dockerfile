# The studio, and the whole command: `docker build -t pursuit .`, then
#   docker run --rm -it -p 127.0.0.1:7400:7400 -v "$PWD:/data" pursuit
# and the address that it prints. The command itself: docker run --rm -v "$PWD:/data" pursuit track clip.mp4 --detect motion
FROM rust:1.95-slim-bookworm AS build
# A C++ compiler for the H.264 encoder of the overlay video; everything else is Rust.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends g++ \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY . .
# Further features of the command, such as `rten,rtsp`: networks by file with nothing installed, RTSP without ffmpeg.
ARG FEATURES=""
RUN cargo build --locked --release --package pursuit-cli --features "$FEATURES"

FROM debian:bookworm-slim
# ffmpeg opens what is not MP4, MOV, AVI, Y4M or a folder of images, and streams.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends ca-certificates ffmpeg \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home --uid 1000 pursuit \
    && install --directory --owner=pursuit /data
COPY --from=build /source/target/release/pursuit /usr/local/bin/pursuit
COPY --from=build /source/LICENSE-MIT /source/LICENSE-APACHE /source/apps/cli/NOTICES.txt /usr/local/share/doc/pursuit/
USER 1000
# Clips are looked for here, and results go to `pursuit-out` in it.
WORKDIR /data
VOLUME /data
EXPOSE 7400
ENTRYPOINT ["pursuit"]
CMD ["studio", "--host", "0.0.0.0", "--port", "7400", "--no-open"]
