# One image for every process: `api`, `worker` and `migrate` are commands of the same program.
FROM python:3.11-slim AS build
WORKDIR /src
COPY requirements/runtime.txt requirements/
RUN python -m venv /opt/proteus \
 && /opt/proteus/bin/pip install --no-cache-dir --require-hashes -r requirements/runtime.txt
COPY requirements/page.txt requirements/
RUN /opt/proteus/bin/python -m venv /opt/page \
 && /opt/page/bin/pip install --no-cache-dir --require-hashes -r requirements/runtime.txt -r requirements/page.txt
COPY pyproject.toml README.md LICENSE ./
COPY proteus proteus
COPY service service
COPY workers workers
RUN /opt/page/bin/python -m service.web \
 && /opt/proteus/bin/pip install --no-cache-dir --no-deps --no-build-isolation .

FROM python:3.11-slim
RUN useradd --system --uid 10001 --create-home proteus \
 && install -d -o proteus -g proteus /var/lib/proteus
COPY --from=build /opt/proteus /opt/proteus
ENV PATH=/opt/proteus/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PROTEUS_DATA_DIR=/var/lib/proteus \
    PROTEUS_HOST=0.0.0.0
USER proteus
VOLUME /var/lib/proteus
EXPOSE 8000
ENTRYPOINT ["proteus"]
CMD ["serve"]
